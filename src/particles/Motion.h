// How drops move: terminal speed, steady wind, gusts and turbulence, all with closed-form integrals, so that the place
// of a drop at any time follows from its place at time 0 without stepping (docs/design.md, "co-moving hashed cells").
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "particles/SharedShaders.h"

namespace virga::particles {

struct MotionSettings {
    glm::dvec2 wind{0.0};   ///< steady wind along world x and z [m/s]
    double gust = 0;        ///< rms of the wind's slow changes [m/s]
    double turbulence = 0;  ///< rms of the small, fast, local changes of a drop's velocity, per axis [m/s]
    double speedScale = 1;  ///< art direction: multiplies the terminal speed
    std::uint32_t seed = 1;
};

/// Three sines of unrelated periods (4 to 17 s) and hashed phases along the wind (or a hashed direction in still air)
/// make the gusts; they move all drops alike. Four waves of 0.4 to 2.5 m and 1 to 4 Hz make the turbulence; they shift
/// drops by amplitude = velocity / frequency, centimetres.
class Motion {
public:
    explicit Motion(const MotionSettings& settings);

    /// Way of a drop of terminal speed `speed` [m/s] from time 0 to t [s], turbulence left out [m].
    glm::dvec3 displacement(double speed, double t) const;
    /// Its derivative [m/s].
    glm::dvec3 velocity(double speed, double t) const;

    /// The waves for a shutter that is open for `exposure` [s].
    std::array<shared::TurbulenceWave, 4> turbulenceWaves(double exposure) const;
    /// Phase [turns] of each wave at a place in a class's own frame [m] and a time [s], in [0, 1]: exact for any frame
    /// number.
    glm::vec4 turbulencePhases(const glm::dvec3& place, double t, int dropClass) const;
    /// Of fall, `speedScale` counted [m/s].
    double fallSpeed(double terminalSpeed) const { return settings_.speedScale * terminalSpeed; }
    bool hasTurbulence() const { return settings_.turbulence > 0; }
    /// No drop is shifted by more than this along an axis [m].
    double turbulenceReach() const;

private:
    struct Gust {
        double velocity, frequency, phase;  // [m/s], [rad/s], [rad]
    };
    struct Wave {
        glm::dvec3 wave, shift;  // [turns/m], [m]
        double frequency;        // [1/s]
    };
    MotionSettings settings_;
    glm::dvec2 gustDirection_{1, 0};
    std::array<Gust, 3> gusts_{};
    std::array<Wave, 4> waves_{};
};

}  // namespace virga::particles
