#include "environment/Highlights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "World.h"
#include "environment/DropRadiance.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

using test::degree;

/// Sky of 0.5 over ground of 0.2, and discs of white.
struct Disc {
    glm::dvec3 direction;
    double radius;
};
Panorama withDiscs(const std::vector<Disc>& discs, float sky = 0.5f, float ground = 0.2f)
{
    Panorama p{ImageF(256, 128, 3)};
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 256; ++x) {
            const glm::dvec3 d = sh::panoramaDirection(x + 0.5, y + 0.5, 256, 128);
            float value = y < 64 ? sky : ground;
            for (const Disc& disc : discs) {
                if (glm::dot(d, glm::normalize(disc.direction)) > std::cos(disc.radius)) value = 1.0f;
            }
            std::fill_n(p.pixels.pixel(x, y), 3, value);
        }
    }
    return p;
}

float at(const Panorama& p, const glm::dvec3& direction)
{
    const glm::dvec2 place = sh::panoramaPlace(direction, p.pixels.width(), p.pixels.height());
    return p.pixels.at(int(place.x) % p.pixels.width(), int(place.y), 1);
}

TEST(Highlights, NothingAtWhiteNothingDone)
{
    Panorama p = withDiscs({});
    const ImageF before = p.pixels;
    const HighlightReport report = repairHighlights(p, "dusk.jpg", {.lightRadiance = 100.0});
    EXPECT_EQ(report.clipped, 0u);
    EXPECT_TRUE(report.said.empty());
    EXPECT_TRUE(std::equal(before.values().begin(), before.values().end(), p.pixels.values().begin()));
}

TEST(Highlights, LampsGetTheRadianceGivenAcrossTheBorderToo)
{
    const glm::dvec3 behind(0.0, 0.4, 1.0), ahead(0.2, 0.5, -1.0);
    Panorama p = withDiscs({{behind, 3 * degree}, {ahead, 2 * degree}});
    const HighlightReport report = repairHighlights(p, "lamps.jpg", {.lightRadiance = 50.0});
    EXPECT_EQ(report.lights, 2);
    EXPECT_FALSE(report.isEstimate);
    EXPECT_NEAR(at(p, behind), 50.0, 1e-4);
    EXPECT_NEAR(at(p, ahead), 50.0, 1e-4);
    EXPECT_EQ(at(p, {1, 0.3, 0}), 0.5f);
    EXPECT_EQ(report.said.size(), 1u);
}

TEST(Highlights, AReflectionBelowTheHorizonIsNoLampBesideOne)
{
    Panorama p = withDiscs({{{0, 0.5, -1}, 2 * degree}, {{0, -0.5, -1}, 2 * degree}});
    repairHighlights(p, "wet.jpg", {.lightRadiance = 50.0});
    EXPECT_NEAR(at(p, {0, 0.5, -1}), 50.0, 1e-4);
    EXPECT_LT(at(p, {0, -0.5, -1}), 2.0);
}

TEST(Highlights, AWhiteSkyIsMadeBrighterByHalfButNoLamp)
{
    // The ground of 0.1 asks for 0.1 / 0.15, less than the sky brings.
    Panorama p = withDiscs({{{0, 0.8, -1}, 50 * degree}}, 0.9f, 0.1f);
    const HighlightReport report = repairHighlights(p, "cloud.jpg");
    EXPECT_FALSE(report.lightRadiance);
    EXPECT_NEAR(at(p, {0, 0.8, -1}), 1.5, 1e-5);
}

TEST(Highlights, ColourOfALampIsItsGlows)
{
    Panorama p = withDiscs({{{0, 0.5, -1}, 2 * degree}});
    // A red glow around it.
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 256; ++x) {
            float* pixel = p.pixels.pixel(x, y);
            const glm::dvec3 d = sh::panoramaDirection(x + 0.5, y + 0.5, 256, 128);
            if (pixel[0] == 1.0f || glm::dot(d, glm::normalize(glm::dvec3(0, 0.5, -1))) < std::cos(6 * degree))
                continue;
            pixel[0] = 0.8f;
            pixel[1] = 0.4f;
            pixel[2] = 0.2f;
        }
    }
    repairHighlights(p, "sodium.jpg", {.lightRadiance = 50.0});
    const glm::dvec2 place = sh::panoramaPlace({0, 0.5, -1}, 256, 128);
    const float* lamp = p.pixels.pixel(int(place.x), int(place.y));
    EXPECT_GT(lamp[0], 1.2f * lamp[1]);
    EXPECT_GT(lamp[1], 1.1f * lamp[2]);
    EXPECT_NEAR(0.2126 * lamp[0] + 0.7152 * lamp[1] + 0.0722 * lamp[2], 50.0, 0.01);
}

TEST(Highlights, InPlatesLampsAreRaisedAndWallsAreNot)
{
    ImageF plate(200, 100, 4, 0.3f);
    const auto paint = [&](int left, int top, int width, int height) {
        for (int y = top; y < top + height; ++y) {
            for (int x = left; x < left + width; ++x) std::fill_n(plate.pixel(x, y), 4, 1.0f);
        }
    };
    paint(10, 10, 6, 6);
    paint(100, 0, 100, 60);
    const HighlightReport report = repairPlateHighlights(plate, 30.0);
    EXPECT_EQ(report.lights, 1);
    EXPECT_EQ(report.clipped, 36u + 6000u);
    EXPECT_NEAR(plate.at(12, 12, 1), 30.0, 1e-4);
    EXPECT_EQ(plate.at(12, 12, 3), 1.0f);
    EXPECT_EQ(plate.at(150, 30, 1), 1.0f);
    EXPECT_EQ(plate.at(50, 50, 1), 0.3f);
}

TEST(Turned, KeepsTheLightAndTurnsIt)
{
    Panorama p = withDiscs({});
    for (int c = 0; c < 3; ++c) p.pixels.at(100, 40, c) = 1000.0f;
    const glm::dvec3 lamp = sh::panoramaDirection(100.5, 40.5, 256, 128);
    const glm::dmat3 rotation = test::look(0.7, 0.4);
    const Panorama q = turned(p, rotation);
    const DropRadianceBaker baker({.order = 4, .lights = false});
    const glm::dvec3 before = baker.bake(p).response.coefficient[0], after = baker.bake(q).response.coefficient[0];
    EXPECT_NEAR(after.g / before.g, 1.0, 0.02);
    EXPECT_GT(at(q, rotation * lamp), 100.0);
    EXPECT_LT(at(q, lamp), 1.0);
}

}  // namespace
}  // namespace virga::environment
