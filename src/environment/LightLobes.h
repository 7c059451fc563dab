// What a small light adds to the radiance of drops: D(theta) of the angle to it, averaged over what blurs it. D itself
// is infinite at rainbows and in the glory (optics/DropTransfer.h); light, drop and map pixel have an extent, the
// average has a value everywhere.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/Image.h"
#include "optics/DropTransfer.h"

namespace virga::environment {

/// A light that was taken out of the environment.
struct Light {
    glm::dvec3 direction;   ///< from the drop, unit vector
    glm::dvec3 energy;      ///< radiance times solid angle
    double radius;          ///< [rad], root mean square distance of its parts from `direction`
    double solidAngle = 0;  ///< [sr], of the pixels that it was taken from

    glm::dvec3 radiance() const { return energy / solidAngle; }
};

class LightLobes {
public:
    /// For R, G, B. Takes 0.1 s.
    explicit LightLobes(const std::array<optics::DropTransferOptions, 3>& transfer);

    /// Half width of the ring that spreads along theta as a light does: a light of radius r has the variance r^2 / 2
    /// along any direction, a ring of half width h the variance h^2 / 3. `blur`: half width of what else blurs it. At
    /// least sharpest.
    static double halfWidth(const Light& light, double blur = 0.0);
    static constexpr double sharpest = 0.0021816615649929116;  ///< [rad], 1/8 degree

    /// Mean of D [1/sr] over the ring [theta - halfWidth, theta + halfWidth].
    glm::dvec3 mean(double theta, double halfWidth) const;

    /// Root mean square over the sphere [1/sr] of what averaging D over rings of `halfWidth` changes. A light of energy
    /// e whose parts are taken for one isotropic light of that extent is wrong by less than e times this.
    double blurError(double halfWidth) const;

    /// Adds the lights to an equirectangular map of radiance, blurred by its pixels. 4 ns a light and pixel.
    void add(ImageF& map, std::span<const Light> lights) const;

private:
    std::vector<glm::dvec3> within_;  // share of the light that is turned by less than theta, R, G, B, in equal steps
    std::vector<double> blurError_;   // by steps of the half width, see errorWidth() in the .cpp
};

}  // namespace virga::environment
