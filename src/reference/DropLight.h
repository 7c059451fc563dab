// The light that a drop returns, by brute force: every pixel of a panorama times D of the angle to it,
//   L(v) = sum over pixels of radiance, solid angle and the mean of D over the pixel's height,
// in double precision. What the fast way (harmonics, lights taken out, baked maps, light grid) is measured against; it
// shares nothing with that but the law of D's energies (optics::binEnergies).
//
// Each pixel is a patch of one radiance, cut into split x split parts; over a part D is averaged along theta by half
// the part's height to either side. What that costs is told by parts of twice the size: docs/light.md has 0.01 to
// 0.34 % RMS over directions, for nine environments.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::reference {

class DropLight {
public:
    static constexpr int bins = 4320;   ///< D's energies are exact in steps of 1/24 degree
    static constexpr int terms = 60;    ///< encounters; 7e-7 of the light is left, and goes anywhere
    static constexpr int steps = 8192;  ///< of the table of D from forward to half-way, and as many from behind

    /// For panoramas of one size. split >= 1; index: refractive, for R, G, B.
    DropLight(int width, int height, int split, const std::array<double, 3>& index);

    /// Radiance that a drop seen along `direction` (from the camera, any length but 0, panorama axes) returns.
    /// panorama: of the size given, 3 channels or more.
    glm::dvec3 operator()(ConstImageViewF panorama, const glm::dvec3& direction) const;

    /// All at once, on all cores; the same on any number of threads.
    std::vector<glm::dvec3> operator()(ConstImageViewF panorama, std::span<const glm::dvec3> directions) const;

private:
    const glm::dvec3& lookup(double cosine) const;

    int width_, height_, split_;
    std::vector<glm::dvec3> table_;
    std::vector<double> area_, sine_, cosine_;  // of each row of parts
    std::vector<double> east_, ahead_;          // of each column of parts
};

}  // namespace virga::reference
