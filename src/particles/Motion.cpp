#include "particles/Motion.h"

#include <cmath>
#include <glm/geometric.hpp>
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
        wave.wave = 1 / lengths[i] * glm::dvec3(flat * std::cos(azimuth), rise, flat * std::sin(azimuth));
        wave.frequency = frequencies[i];
        // Each wave moves drops along its own horizontal direction, a little up and down; directions a quarter turn
        // apart share the variance evenly between x and z: two waves an axis, each of rms velocity turbulence /
        // sqrt(2). The parabolic wave of amplitude a has the triangle wave of amplitude 8 a for its slope, rms 8 a /
        // sqrt(3).
        const double angle = tau * (unit(settings.seed, 320) + 0.25 * i);
        const double velocity = settings.turbulence / std::sqrt(2.0);
        wave.shift =
            velocity * std::sqrt(3.0) / (8 * wave.frequency) * glm::dvec3(std::cos(angle), 0.3, std::sin(angle));
    }
}

glm::dvec3 Motion::displacement(double speed, double t) const
{
    double gust = 0;
    for (const Gust& g : gusts_)
        gust += g.velocity / g.frequency * (std::cos(g.phase) - std::cos(g.frequency * t + g.phase));
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
                    glm::vec4(glm::vec3(waves_[i].shift), 0.5f)};
    return waves;
}

glm::vec4 Motion::turbulencePhases(const glm::dvec3& place, double t, int dropClass) const
{
    const auto fraction = [](double turns) { return turns - std::floor(turns); };
    glm::vec4 phases;
    for (int i = 0; i < 4; ++i) {
        const double own = unit(settings_.seed, 400 + 4 * std::uint64_t(dropClass) + std::uint64_t(i));
        phases[i] =
            float(fraction(fraction(glm::dot(waves_[i].wave, place)) + fraction(waves_[i].frequency * t) + own));
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
