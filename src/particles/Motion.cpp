#include "particles/Motion.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

#include "particles/CellHash.h"

namespace virga::particles {
namespace {

constexpr double tau = 2 * std::numbers::pi;

double unit(std::uint64_t seed, std::uint64_t what) { return unitDouble(mix(mix(seed) ^ what)); }

}  // namespace

Motion::Motion(const MotionSettings& settings) : settings_(settings)
{
    const double speed = glm::length(settings.wind);
    const double heading = tau * unit(settings.seed, 100);
    gustDirection_ = speed > 0 ? settings.wind / speed : glm::dvec2(std::cos(heading), std::sin(heading));

    // rms of three equal sines of amplitude a is a sqrt(3/2).
    constexpr std::array<double, 3> periods = {4.1, 7.7, 16.9};
    for (int i = 0; i < 3; ++i)
        gusts_[i] = {settings.gust / std::sqrt(1.5), tau / periods[i], tau * unit(settings.seed, 200 + i)};

    constexpr std::array<double, 4> lengths = {0.43, 0.78, 1.37, 2.5};
    constexpr std::array<double, 4> frequencies = {3.9, 2.7, 1.9, 1.1};
    for (int i = 0; i < 4; ++i) {
        const double azimuth = tau * unit(settings.seed, 300 + i);
        const double rise = 2 * unit(settings.seed, 310 + i) - 1;
        const double flat = std::sqrt(1 - rise * rise);
        Wave& wave = waves_[i];
        wave.wave = tau / lengths[i] * glm::dvec3(flat * std::cos(azimuth), rise, flat * std::sin(azimuth));
        wave.frequency = tau * frequencies[i];
        // Each wave moves drops along its own horizontal direction, a little up and down; directions a quarter turn
        // apart share the variance evenly between x and z. rms of a sine is amplitude / sqrt(2).
        const double angle = tau * (unit(settings.seed, 320) + 0.25 * i);
        const double velocity = settings.turbulence;  // two waves an axis, each of rms velocity / sqrt(2)
        wave.shift = velocity / wave.frequency * glm::dvec3(std::cos(angle), 0.3, std::sin(angle));
    }
}

glm::dvec3 Motion::displacement(double speed, double t) const
{
    double gust = 0;
    for (const Gust& g : gusts_) gust += g.velocity / g.frequency * (std::cos(g.phase) - std::cos(g.frequency * t + g.phase));
    const glm::dvec2 flat = settings_.wind * t + gustDirection_ * gust;
    return {flat.x, -speed * settings_.speedScale * t, flat.y};
}

glm::dvec3 Motion::velocity(double speed, double t) const
{
    double gust = 0;
    for (const Gust& g : gusts_) gust += g.velocity * std::sin(g.frequency * t + g.phase);
    const glm::dvec2 flat = settings_.wind + gustDirection_ * gust;
    return {flat.x, -speed * settings_.speedScale, flat.y};
}

std::array<shared::TurbulenceWave, 4> Motion::turbulenceWaves(double exposure) const
{
    std::array<shared::TurbulenceWave, 4> waves;
    for (int i = 0; i < 4; ++i)
        // Half a turn of the phase is the drop's own: neighbours lean alike, but not in step.
        waves[i] = {glm::vec4(glm::vec3(waves_[i].wave), float(waves_[i].frequency * exposure)),
                    glm::vec4(glm::vec3(waves_[i].shift), float(std::numbers::pi))};
    return waves;
}

glm::vec4 Motion::turbulencePhases(const glm::dvec3& place, double t, int dropClass) const
{
    glm::vec4 phases;
    for (int i = 0; i < 4; ++i) {
        const double own = tau * unit(settings_.seed, 400 + 4 * std::uint64_t(dropClass) + i);
        double phase = std::fmod(glm::dot(waves_[i].wave, place), tau) + std::fmod(waves_[i].frequency * t, tau) + own;
        phase = std::fmod(phase, tau);
        phases[i] = float(phase < 0 ? phase + tau : phase);
    }
    return phases;
}

double Motion::turbulenceReach() const
{
    double reach = 0;
    for (const Wave& wave : waves_) reach += glm::length(wave.shift);
    return reach;
}

}  // namespace virga::particles
