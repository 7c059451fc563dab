// A world whose every direction is known, and cameras that film it: the truth for panoramas that are made from footage.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "core/Image.h"

namespace virga::environment::test {

inline constexpr double degree = std::numbers::pi / 180;

/// Columns are the camera's axes: turned right by yaw, then up by pitch.
inline glm::dmat3 look(double yaw, double pitch)
{
    const glm::dvec3 forward(std::cos(pitch) * std::sin(yaw), std::sin(pitch), -std::cos(pitch) * std::cos(yaw));
    const glm::dvec3 right(std::cos(yaw), 0.0, std::sin(yaw));
    return {right, glm::cross(right, forward), -forward};
}

/// 0 to 1, from integers.
inline double hashed(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t salt)
{
    std::uint64_t h = salt * 0x9E3779B97F4A7C15u + std::uint64_t(x) * 0xBF58476D1CE4E5B9u +
                      std::uint64_t(y) * 0x94D049BB133111EBu + std::uint64_t(z) * 0xD6E8FEB86659FD93u;
    h ^= h >> 31;
    h *= 0xBF58476D1CE4E5B9u;
    h ^= h >> 29;
    h *= 0x94D049BB133111EBu;
    h ^= h >> 32;
    return double(h >> 11) * 0x1p-53;
}

/// Blocks of three sizes below a smooth sky: corners everywhere, and no two alike. Radiance of about 0.05 to 0.9.
inline glm::dvec3 worldRadiance(const glm::dvec3& direction)
{
    const glm::dvec3 d = glm::normalize(direction);
    glm::dvec3 color(0.0);
    for (const double size : {6.0, 14.0, 40.0}) {
        const auto cell = [size](double x) { return std::int64_t(std::floor(x * size)); };
        for (int c = 0; c < 3; ++c)
            color[c] += hashed(cell(d.x), cell(d.y), cell(d.z), std::uint64_t(size)) / 3 +
                        0.1 * hashed(cell(d.x), cell(d.y), cell(d.z), std::uint64_t(size) + 100 + std::uint64_t(c));
    }
    const double sky = std::clamp((d.y - 0.35) / 0.3, 0.0, 1.0);
    return (1.0 - sky) * 0.5 * color + sky * glm::dvec3(0.6, 0.7, 0.8) * (1.0 - 0.3 * d.z);
}

/// A frame of the world, each pixel the mean of 2 x 2 rays.
inline ImageF filmed(int width, int height, double horizontalFov, const glm::dmat3& worldFromCamera, double gain = 1.0)
{
    ImageF plate(width, height, 3);
    const double step = 2.0 * std::tan(0.5 * horizontalFov) / width;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            glm::dvec3 sum(0.0);
            for (const double j : {0.25, 0.75}) {
                for (const double i : {0.25, 0.75})
                    sum += worldRadiance(worldFromCamera *
                                         glm::dvec3((x + i - 0.5 * width) * step, (0.5 * height - y - j) * step, -1.0));
            }
            for (int c = 0; c < 3; ++c) plate.at(x, y, c) = float(gain * sum[c] / 4.0);
        }
    }
    return plate;
}

}  // namespace virga::environment::test
