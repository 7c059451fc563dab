// Equirectangular panoramas: which pixel looks where. docs/conventions.md: +y at the top row, the centre column looks
// down -z, +x a quarter to the right. Pixel (i, j) covers [i, i+1] x [j, j+1]; its centre is at (i + 1/2, j + 1/2).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "core/Image.h"

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

/// The value of a map of 3 or more channels along `direction`: bilinear between the pixels' centres, wrapped in x, held
/// in y beyond the first and last row's centres. As shaders/common_environment.glsl does it.
inline glm::dvec3 sampleMap(ConstImageViewF map, const glm::dvec3& direction)
{
    const glm::dvec2 place = panoramaPlace(direction, map.width(), map.height()) - 0.5;
    const double x = std::floor(place.x), y = std::floor(place.y);
    const auto texel = [&](double tx, double ty) {
        const int wrapped = (int(tx) + map.width()) % map.width();
        const float* p = map.pixel(wrapped, std::clamp(int(ty), 0, map.height() - 1));
        return glm::dvec3(p[0], p[1], p[2]);
    };
    const double a = place.x - x, b = place.y - y;
    return (1 - b) * ((1 - a) * texel(x, y) + a * texel(x + 1, y)) +
           b * ((1 - a) * texel(x, y + 1) + a * texel(x + 1, y + 1));
}

}  // namespace virga::sh
