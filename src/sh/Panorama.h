// Equirectangular panoramas: which pixel looks where. docs/conventions.md: +y at the top row, the centre column looks
// down -z, +x a quarter to the right. Pixel (i, j) covers [i, i+1] x [j, j+1]; its centre is at (i + 1/2, j + 1/2).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>

namespace virga::sh {

/// Unit vector of the place (x, y) in [0, width] x [0, height].
inline glm::dvec3 panoramaDirection(double x, double y, int width, int height) noexcept
{
    const double azimuth = (x / width - 0.5) * 2.0 * std::numbers::pi;
    const double polar = y / height * std::numbers::pi;
    return {std::sin(polar) * std::sin(azimuth), std::cos(polar), -std::sin(polar) * std::cos(azimuth)};
}

/// The place in [0, width] x [0, height] that looks along `direction`, of any length but 0. At the poles x is width
/// / 2.
inline glm::dvec2 panoramaPlace(const glm::dvec3& direction, int width, int height) noexcept
{
    const double azimuth = std::atan2(direction.x, -direction.z + 0.0);
    const double polar = std::atan2(std::hypot(direction.x, direction.z), direction.y);
    return {(azimuth / (2.0 * std::numbers::pi) + 0.5) * width, polar / std::numbers::pi * height};
}

}  // namespace virga::sh
