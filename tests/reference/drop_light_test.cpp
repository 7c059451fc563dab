// The light in a drop, against rays that are followed through the sphere one by one.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "reference/DropLight.h"
#include "sh/Panorama.h"

namespace virga::reference {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double index = 1.333;

/// A world with a bright side, a dark floor and a band of colour.
glm::dvec3 world(const glm::dvec3& d)
{
    return {1 + 0.8 * d.x, 0.6 + 0.4 * d.y + 0.3 * d.z * d.x, 0.5 + 0.4 * std::cos(3 * d.y)};
}

ImageF panoramaOf(int width)
{
    ImageF image(width, width / 2, 3);
    for (int y = 0; y < width / 2; ++y)
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 value = world(sh::panoramaDirection(x + 0.5, y + 0.5, width, width / 2));
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(value[c]);
        }
    return image;
}

/// Snell's law in vectors. normal: against the ray; ratio: of the refractive indices, here over there.
glm::dvec3 refracted(const glm::dvec3& ray, const glm::dvec3& normal, double ratio)
{
    const double along = glm::dot(ray, normal);
    const double left = std::max(0.0, 1 - ratio * ratio * (1 - along * along));  // 0 for a ray that just grazes
    return ratio * ray - (ratio * along + std::sqrt(left)) * normal;
}

/// Rays from the camera into a sphere of water: at each meeting with the surface a part of each polarisation leaves.
/// Snell's and Fresnel's laws; no angle zeta, no transfer function.
glm::dvec3 traced(const glm::dvec3& view)
{
    const glm::dvec3 up = std::abs(view.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
    const glm::dvec3 right = glm::normalize(glm::cross(view, up)), top = glm::cross(right, view);
    constexpr int rings = 400, spokes = 48, meetings = 30;
    glm::dvec3 sum(0.0);
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < spokes; ++j) {
            const double b = std::sqrt((i + 0.5) / rings), phi = 2 * pi * (j + 0.5 * (i % 2)) / spokes;
            glm::dvec3 at = b * (std::cos(phi) * right + std::sin(phi) * top) - std::sqrt(1 - b * b) * view;
            const double cosIn = std::sqrt(1 - b * b), cosOut = std::sqrt(1 - b * b / (index * index));
            const double s = (cosIn - index * cosOut) / (cosIn + index * cosOut);
            const double p = (index * cosIn - cosOut) / (index * cosIn + cosOut);
            const double reflected[2] = {s * s, p * p};
            sum += 0.5 * (reflected[0] + reflected[1]) * world(glm::reflect(view, at));
            glm::dvec3 ray = refracted(view, at, 1 / index);
            double inside[2] = {1 - reflected[0], 1 - reflected[1]};
            for (int k = 0; k < meetings; ++k) {
                at = glm::normalize(at - 2 * glm::dot(at, ray) * ray);  // the far end of the chord
                const glm::dvec3 leaves = refracted(ray, -at, index);
                double power = 0;
                for (int q = 0; q < 2; ++q) {
                    power += 0.5 * inside[q] * (1 - reflected[q]);
                    inside[q] *= reflected[q];
                }
                sum += power * world(leaves);
                ray = glm::normalize(glm::reflect(ray, -at));
            }
        }
    return sum / double(rings * spokes);
}

TEST(DropLight, IsWhatRaysThroughTheSphereBring)
{
    const DropLight light(128, 64, 2, {index, index, index});
    const ImageF panorama = panoramaOf(128);
    for (const glm::dvec3& view : {glm::dvec3(0, 0, -1), glm::dvec3(1, 0, 0),
                                   glm::normalize(glm::dvec3(-0.4, 0.7, 0.5)), glm::dvec3(0, -1, 0)}) {
        const glm::dvec3 sum = light(panorama, view), rays = traced(view);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], rays[c], 1e-3) << view.x << " " << view.y;
    }
}

TEST(DropLight, IsWhiteInAWhiteWorld)
{
    const DropLight light(64, 32, 4, {1.331, 1.333, 1.338});
    const ImageF white(64, 32, 3, 1);
    for (const glm::dvec3& view : {glm::dvec3(0.3, 0.2, -1), glm::dvec3(0, 1, 0), glm::dvec3(-1, -0.7, 0.1)}) {
        const glm::dvec3 sum = light(white, view);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], 1, 2e-3);
    }
}

TEST(DropLight, SmallerPartsComeNearer)
{
    const ImageF panorama = panoramaOf(64);
    const std::array<double, 3> indices = {index, index, index};
    const glm::dvec3 view = glm::normalize(glm::dvec3(0.5, 0.3, -1));
    const glm::dvec3 rays = traced(view);
    const double coarse = glm::distance(DropLight(64, 32, 1, indices)(panorama, view), rays);
    const double fine = glm::distance(DropLight(64, 32, 8, indices)(panorama, view), rays);
    EXPECT_LT(fine, 0.6 * coarse + 2e-4) << coarse << " " << fine;
}

}  // namespace
}  // namespace virga::reference
