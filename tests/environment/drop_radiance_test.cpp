#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/DropRadiance.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

template <class F>
Panorama paint(int width, int height, F&& radiance)
{
    Panorama result{ImageF(width, height, 3)};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 c = radiance(sh::panoramaDirection(x + 0.5, y + 0.5, width, height));
            for (int k = 0; k < 3; ++k) result.pixels.at(x, y, k) = float(c[k]);
        }
    }
    return result;
}

std::vector<glm::dvec3> directions(int count)
{
    std::vector<glm::dvec3> result;
    for (int i = 0; i < count; ++i) {
        const double y = 1.0 - 2.0 * (i + 0.5) / count;
        const double azimuth = i * pi * (3.0 - std::sqrt(5.0));
        const double s = std::sqrt(1.0 - y * y);
        result.emplace_back(s * std::sin(azimuth), y, -s * std::cos(azimuth));
    }
    return result;
}

TEST(DropRadiance, AWhiteWorldIsWhiteAtEveryOrder)
{
    for (const int order : {DropRadianceOptions::autoOrder, 0, 1, 3, 8, 12, 31, 64, 128}) {
        const DropRadianceBaker baker({.order = order, .lights = false});
        for (const auto& [width, height] :
             {std::array{1, 1}, std::array{2, 1}, std::array{64, 32}, std::array{300, 150}}) {
            const DropRadiance r = baker.bake(paint(width, height, [](auto) { return glm::dvec3(1.0, 1.0, 1.0); }));
            for (const float value : r.radiance.values()) ASSERT_NEAR(value, 1.0f, 1e-6f) << order;
            for (const float value : r.background.values()) ASSERT_NEAR(value, 1.0f, 1e-6f) << order;
        }
    }
}

TEST(DropRadiance, AWhiteWorldHasNoLights)
{
    const DropRadianceBaker baker;
    const DropRadiance r = baker.bake(paint(128, 64, [](auto) { return glm::dvec3(0.3); }));
    EXPECT_TRUE(r.lights.empty());
    EXPECT_EQ(r.order, 0);
    for (const float value : r.radiance.values()) ASSERT_NEAR(value, 0.3f, 1e-6f);
}

TEST(DropRadiance, PaperModeKeepsThePapersArithmetic)
{
    const DropRadianceBaker baker({.paper = true});
    const DropRadiance r = baker.bake(paint(64, 32, [](auto) { return glm::dvec3(1.0); }));
    EXPECT_TRUE(r.paper);
    EXPECT_EQ(r.order, 3);
    // Nine terms hold 99.983 % of the power.
    for (const float value : r.radiance.values()) ASSERT_NEAR(value, 0.9998284f, 1e-6f);
}

}  // namespace
}  // namespace virga::environment
