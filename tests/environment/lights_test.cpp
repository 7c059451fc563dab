// Lights taken out of environments, and the whole of the light that drops return beside brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/DropRadiance.h"
#include "reference/DropLight.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int width = 256, height = 128;

std::vector<glm::dvec3> directions(int count)
{
    std::vector<glm::dvec3> result;
    for (int i = 0; i < count; ++i) {
        const double y = 1.0 - 2.0 * (i + 0.5) / count, azimuth = i * pi * (3.0 - std::sqrt(5.0));
        const double s = std::sqrt(1.0 - y * y);
        result.emplace_back(s * std::sin(azimuth), y, -s * std::cos(azimuth));
    }
    return result;
}

Panorama dusk()
{
    Panorama world{ImageF(width, height, 3)};
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double up = sh::panoramaDirection(x + 0.5, y + 0.5, width, height).y;
            const double sky = up > 0 ? 0.3 + 0.2 * up : 0.1 + 0.02 * std::sin(0.3 * x);
            for (int c = 0; c < 3; ++c) world.pixels.at(x, y, c) = float(sky * (1 + 0.2 * c));
        }
    }
    return world;
}

struct World {
    const char* name;
    Panorama panorama;
};

std::vector<World> worlds()
{
    std::vector<World> all;
    const auto add = [&](const char* name, const std::function<void(ImageF&)>& paint) {
        all.push_back({name, dusk()});
        paint(all.back().panorama.pixels);
    };
    const auto set = [](ImageF& image, int x, int y, float value) {
        for (int c = 0; c < 3; ++c) image.at(x % width, y, c) = value * (1.2f - 0.2f * float(c));
    };
    add("no light", [](ImageF&) {});
    add("a sun", [&](ImageF& image) { set(image, 90, 40, 4e3f); });
    // What tiles of any size would cut apart: corners of 1, 2, 4, ... pixels, and the seam.
    add("a sun on four pixels", [&](ImageF& image) {
        for (const int x : {127, 128})
            for (const int y : {63, 64}) set(image, x, y, 1e3f);
    });
    add("a sun across the seam", [&](ImageF& image) {
        for (const int x : {255, 256})
            for (const int y : {31, 32}) set(image, x, y, 1e3f);
    });
    add("a sun in the zenith", [&](ImageF& image) {
        for (int x = 0; x < width; ++x) set(image, x, 0, 2e3f);
    });
    add("one pixel of the row at the pole", [&](ImageF& image) { set(image, 17, 0, 1e5f); });
    add("a moon", [&](ImageF& image) {
        for (int y = 38; y < 44; ++y)
            for (int x = 60; x < 66; ++x) set(image, x, y, 60);
    });
    add("a tube", [&](ImageF& image) {
        for (int x = 100; x < 130; ++x) set(image, x, 50, 80);
    });
    add("three hundred lamps", [&](ImageF& image) {
        for (int i = 0; i < 300; ++i) set(image, 7 + 97 * i, 30 + 13 * i % 41, float(20 + i % 7 * 20));
    });
    add("one pixel of 1e9", [&](ImageF& image) { set(image, 200, 70, 1e9f); });
    return all;
}

struct Deviation {
    double rms = 0, largest = 0;  // over the mean
};
template <class Found>
Deviation deviation(const std::vector<glm::dvec3>& views, const std::vector<glm::dvec3>& truth, Found&& found)
{
    Deviation d;
    double mean = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const glm::dvec3 e = found(views[i]) - truth[i];
        d.rms += glm::dot(e, e) / (3.0 * double(views.size()));
        d.largest = std::max({d.largest, std::abs(e.r), std::abs(e.g), std::abs(e.b)});
        mean += (truth[i].r + truth[i].g + truth[i].b) / (3.0 * double(views.size()));
    }
    return {std::sqrt(d.rms) / mean, d.largest / mean};
}

// The promise: root mean square error under 1 % of the mean, of sums and of maps, whatever shines; and `remainder`
// tells of it, exactly for bands, within a factor for the extents of lights.
TEST(Lights, DropsAreRightUnderAnyLight)
{
    const DropRadianceBaker baker;
    const reference::DropLight integral(width, height, 4, baker.options().index);
    const auto views = directions(300);
    for (const World& world : worlds()) {
        const DropRadiance light = baker.bake(world.panorama);
        const auto truth = integral(world.panorama.pixels, views);
        const Deviation exact = deviation(views, truth, [&](auto v) { return baker.exactly(light, v); });
        const Deviation map = deviation(views, truth, [&](auto v) { return sampleMap(light.radiance, v); });
        EXPECT_LT(exact.rms, 0.01) << world.name;
        EXPECT_LT(map.rms, 0.01) << world.name;
        EXPECT_LT(exact.rms, 3 * light.remainder + 5e-4) << world.name << ", " << light.lights.size() << " lights";
    }
}

// The split may move: at 4 to 32 times the mean, and with far more or fewer lights, the picture stays.
TEST(Lights, WhereTheSplitLiesDoesNotShow)
{
    const auto views = directions(500);
    const DropRadianceBaker usual;
    std::vector<DropRadianceBaker> bakers;
    for (const double threshold : {4.0, 16.0, 32.0})
        bakers.emplace_back(DropRadianceOptions{.lightThreshold = threshold});
    for (const World& world : worlds()) {
        // A second each; these are round, long, many, and cut by pixels' borders.
        const std::string name = world.name;
        if (name != "a moon" && name != "a tube" && name != "three hundred lamps" && name != "a sun on four pixels")
            continue;
        const DropRadiance at8 = usual.bake(world.panorama);
        std::vector<glm::dvec3> truth;
        for (const auto& v : views) truth.push_back(sampleMap(at8.radiance, v));
        for (const DropRadianceBaker& baker : bakers) {
            const DropRadiance moved = baker.bake(world.panorama);
            const Deviation d = deviation(views, truth, [&](auto v) { return sampleMap(moved.radiance, v); });
            EXPECT_LT(d.rms, 0.006) << world.name << " at " << baker.options().lightThreshold;
        }
    }
}

TEST(Lights, WhatIsTakenAndWhatStaysIsWhatWas)
{
    const LightLobes lobes(
        {optics::DropTransferOptions{}, optics::DropTransferOptions{}, optics::DropTransferOptions{}});
    for (const World& world : worlds()) {
        ImageF rest = world.panorama.pixels;
        const TakenLights taken = takeLights(rest, lobes, {});
        const glm::dvec3 before = sh::projectPanorama(world.panorama.pixels, 0, sh::PixelValue::Mean).coefficient[0];
        glm::dvec3 after = sh::projectPanorama(rest, 0, sh::PixelValue::Mean).coefficient[0];
        double solidAngle = 0;
        for (const Light& light : taken.lights) {
            after += light.energy / std::sqrt(4 * pi);
            EXPECT_NEAR(glm::length(light.direction), 1, 1e-12);
            EXPECT_GT(light.solidAngle, 0);
            EXPECT_LT(glm::length(light.radiance() * light.solidAngle / light.energy - 1.0), 1e-12);
            solidAngle += light.solidAngle;
        }
        EXPECT_LT(solidAngle, 4 * pi);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c] / before[c], 1, 1e-6) << world.name;
        for (std::size_t i = 0; i < rest.size(); ++i) {
            ASSERT_LE(rest.data()[i], world.panorama.pixels.data()[i] * (1 + 1e-6f));
        }
    }
}

TEST(Lights, ASunIsWhereAndAsLargeAsItIs)
{
    // 1.4 degrees of radius on pixels of 0.35 degrees: cut into few parts, which together are the disc.
    ImageF image(1024, 512, 3, 0.2f);
    const glm::dvec3 sun = glm::normalize(glm::dvec3(0.4, 0.5, -1));
    const double radius = 1.4 * pi / 180;
    for (int y = 0; y < 512; ++y)
        for (int x = 0; x < 1024; ++x)
            if (glm::dot(sh::panoramaDirection(x + 0.5, y + 0.5, 1024, 512), sun) > std::cos(radius))
                for (int c = 0; c < 3; ++c) image.at(x, y, c) = 50;
    const LightLobes lobes(
        {optics::DropTransferOptions{}, optics::DropTransferOptions{}, optics::DropTransferOptions{}});
    const TakenLights taken = takeLights(image, lobes, {});
    glm::dvec3 place(0.0), energy(0.0);
    double solidAngle = 0;
    for (const Light& light : taken.lights) {
        place += light.direction * light.energy.g;
        energy += light.energy;
        solidAngle += light.solidAngle;
        EXPECT_LT(light.radius, radius);
    }
    EXPECT_LT(glm::length(glm::normalize(place) - sun), 2e-3);
    EXPECT_NEAR(solidAngle / (2 * pi * (1 - std::cos(radius))), 1, 0.03);
    EXPECT_NEAR(energy.g / (50 * solidAngle), 1, 0.05);  // less the threshold
}

// D through rings: its mean over the sphere is one, whatever the width, and a wide ring forgets the rainbow.
TEST(Lights, LobesHoldAllOfTheLight)
{
    const LightLobes lobes({optics::DropTransferOptions{}, {.index = 1.4}, {.index = 1.6}});
    for (const double halfWidth : {LightLobes::sharpest, 0.01, 0.1}) {
        glm::dvec3 sum(0.0);
        constexpr int steps = 20000;
        for (int i = 0; i < steps; ++i) {
            const double theta = pi * (i + 0.5) / steps;
            sum += 2 * pi * std::sin(theta) * pi / steps * lobes.mean(theta, halfWidth);
        }
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(sum[c], 1, 0.2 * halfWidth + 1e-4) << halfWidth;
    }
    EXPECT_EQ(lobes.blurError(LightLobes::sharpest), 0);
    for (double w = LightLobes::sharpest; w < 0.4; w *= 1.3) EXPECT_GT(lobes.blurError(1.3 * w), lobes.blurError(w));

    Light light{{0, 0, -1}, glm::dvec3(1.0), 0.001};
    ImageF map(512, 256, 3);
    lobes.add(map, {&light, 1});
    for (const double theta : {0.1, 1.0, 2.0, 2.5}) {
        const glm::dvec3 v(std::sin(theta), 0, -std::cos(theta));
        const glm::dvec3 expected = lobes.mean(theta, LightLobes::halfWidth(light, pi / 512));
        EXPECT_LT(glm::length(sampleMap(map, v) - expected), 0.03 * glm::length(expected)) << theta;
    }
}

TEST(Lights, ThreadsDoNotChangeABit)
{
    const DropRadianceBaker baker;
    const Panorama world = worlds()[8].panorama;
    const DropRadiance many = baker.bake(world);
    const ThreadLimit one(1);
    const DropRadiance alone = baker.bake(world);
    ASSERT_EQ(many.radiance.size(), alone.radiance.size());
    EXPECT_TRUE(
        std::equal(many.radiance.values().begin(), many.radiance.values().end(), alone.radiance.values().begin()));
}

TEST(Lights, RefuseThresholdsOfOneAndLess) { EXPECT_THROW(DropRadianceBaker({.lightThreshold = 1.0}), Error); }

}  // namespace
}  // namespace virga::environment
