#include "environment/Panorama.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "core/Error.h"
#include "environment/DropRadiance.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float inf = std::numeric_limits<float>::infinity();

TEST(PreparePanorama, AFullSphereStaysAsItIs)
{
    ImageF image(64, 32, 3, 0.5f);
    image.at(3, 4, 1) = 7.0f;
    PanoramaReport report;
    const Panorama p = preparePanorama(image, "sky.exr", &report);
    EXPECT_TRUE(std::equal(p.pixels.values().begin(), p.pixels.values().end(), image.values().begin()));
    EXPECT_EQ(report.takenFor, "a full sphere");
    EXPECT_EQ(report.brightest, 7.0f);
    EXPECT_TRUE(report.said.empty());
}

TEST(PreparePanorama, RepairsAndCounts)
{
    ImageF image(8, 4, 3, 0.5f);
    image.at(0, 0, 0) = nan;
    image.at(7, 0, 2) = inf;
    image.at(3, 1, 1) = -0.25f;
    for (int x = 0; x < 8; ++x) image.at(x, 3, 0) = -inf;
    PanoramaReport report;
    const Panorama p = preparePanorama(image, "sky.exr", &report);
    EXPECT_EQ(report.nan, 1u);
    EXPECT_EQ(report.infinite, 9u);
    EXPECT_EQ(report.negative, 1u);
    EXPECT_EQ(report.said.size(), 2u);
    for (int y = 0; y < 4; ++y) {
        for (int x = 0; x < 8; ++x) {
            for (int c = 0; c < 3; ++c) EXPECT_EQ(p.pixels.at(x, y, c), x == 3 && y == 1 && c == 1 ? 0.0f : 0.5f);
        }
    }
}

TEST(PreparePanorama, HolesAreFilledFromBothSidesAroundTheSeam)
{
    ImageF image(8, 4, 3, 1.0f);
    for (int c = 0; c < 3; ++c) {
        image.at(6, 2, c) = 2.0f;
        image.at(1, 2, c) = 5.0f;
    }
    image.at(7, 2, 0) = image.at(0, 2, 0) = nan;
    const Panorama p = preparePanorama(image, "sky.exr");
    EXPECT_FLOAT_EQ(p.pixels.at(7, 2), 3.0f);
    EXPECT_FLOAT_EQ(p.pixels.at(0, 2), 4.0f);
}

TEST(PreparePanorama, OtherShapesAndChannels)
{
    PanoramaReport report;
    EXPECT_EQ(preparePanorama(ImageF(1, 1, 3, 0.2f), "dot.exr", &report).pixels.at(0, 0, 2), 0.2f);
    EXPECT_EQ(report.takenFor, "a uniform sphere");

    ImageF band(90, 30, 4, 0.0f);
    for (int x = 0; x < 90; ++x) {
        for (int y = 0; y < 30; ++y) band.at(x, y, 1) = y < 15 ? 2.0f : 1.0f;
    }
    const Panorama sphere = preparePanorama(band, "band.exr", &report);
    EXPECT_EQ(sphere.pixels.width(), 90);
    EXPECT_EQ(sphere.pixels.height(), 45);
    EXPECT_FLOAT_EQ(sphere.pixels.at(17, 0, 1), 2.0f);
    EXPECT_FLOAT_EQ(sphere.pixels.at(17, 44, 1), 1.0f);
    EXPECT_EQ(report.takenFor, "a band of 360 x 120 degrees around the horizon");
    EXPECT_EQ(report.said.size(), 2u);

    const Panorama grey = preparePanorama(ImageF(8, 4, 1, 0.4f), "grey.png");
    EXPECT_EQ(grey.pixels.at(5, 3, 2), 0.4f);

    PanoramaReport dark;
    preparePanorama(ImageF(8, 4, 3), "black.exr", &dark);
    EXPECT_TRUE(dark.black);
    EXPECT_EQ(dark.said.size(), 1u);
}

TEST(PreparePanorama, RefusesWhatIsNoPanorama)
{
    for (const auto& [width, height] :
         {std::array{400, 300}, std::array{64, 64}, std::array{1, 2}, std::array{185, 100}}) {
        try {
            preparePanorama(ImageF(width, height, 3, 1.0f), "cross.exr");
            FAIL() << width << " x " << height;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::Input);
            EXPECT_NE(std::string(error.what()).find("cross.exr"), std::string::npos);
        }
    }
    EXPECT_THROW(preparePanorama(ImageF(8, 4, 3, nan), "void.exr"), Error);
    EXPECT_THROW(preparePanorama(ImageF(), "empty.exr"), Error);
}

// ---------------------------------------------------------------------------------------------------------------------

/// Columns are the camera's axes: turned right by yaw, then up by pitch.
glm::dmat3 look(double yaw, double pitch)
{
    const glm::dvec3 forward(std::cos(pitch) * std::sin(yaw), std::sin(pitch), -std::cos(pitch) * std::cos(yaw));
    const glm::dvec3 right(std::cos(yaw), 0.0, std::sin(yaw));
    return {right, glm::cross(right, forward), -forward};
}

glm::dvec3 towards(const Panorama& p, double yaw, double elevation)
{
    return sampleMap(p.pixels,
                     {std::cos(elevation) * std::sin(yaw), std::sin(elevation), -std::cos(elevation) * std::cos(yaw)});
}

/// Left third red, middle green, right blue; the upper half brighter.
ImageF flag(int width, int height)
{
    ImageF plate(width, height, 4, 1.0f);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c)
                plate.at(x, y, c) = (3 * x / width == c ? 0.3f : 0.02f) * (y < height / 2 ? 1.5f : 0.5f);
        }
    }
    return plate;
}

TEST(PlatePanorama, ThePlateIsWhereTheCameraLooks)
{
    for (const double yaw : {0.0, pi / 2, -2.0}) {
        for (const double pitch : {0.0, 0.4, -0.3}) {
            const Panorama p = panoramaFromPlate(flag(320, 180), 60 * degree, look(yaw, pitch), {.width = 256});
            const glm::dvec3 ahead = towards(p, yaw, pitch + 5 * degree);
            EXPECT_NEAR(ahead.g, 0.45, 0.02);
            EXPECT_LT(ahead.r, 0.1);
            EXPECT_NEAR(towards(p, yaw, pitch - 5 * degree).g, 0.15, 0.02);
            EXPECT_GT(towards(p, yaw + 20 * degree, pitch).b, 0.1);  // right of the axis
            EXPECT_GT(towards(p, yaw - 20 * degree, pitch).r, 0.1);
        }
    }
}

TEST(PlatePanorama, AUniformPlateIsAUniformWorld)
{
    for (const float level : {0.01f, 0.18f, 1.0f}) {
        const Panorama p = panoramaFromPlate(ImageF(192, 108, 4, level), 1.0, look(0.3, -0.2));
        // The plate's alpha is its level too: premultiplied, so the colour is 1.
        for (const float value : p.pixels.values()) ASSERT_NEAR(value, 1.0f, 1e-6f);
        const Panorama opaque = panoramaFromPlate(ImageF(192, 108, 3, level), 1.0, look(0.3, -0.2));
        for (const float value : opaque.pixels.values()) ASSERT_NEAR(value, level, 1e-6f);
    }
}

/// Ground of 0.15 with some texture, below a top of the given radiance.
ImageF scene(float top, float scale = 1.0f, float groundScale = 1.0f)
{
    ImageF plate(240, 135, 3);
    for (int y = 0; y < 135; ++y) {
        for (int x = 0; x < 240; ++x) {
            const float ground = groundScale * (0.15f + 0.1f * std::sin(0.11f * float(x)) * std::sin(0.2f * float(y)));
            for (int c = 0; c < 3; ++c) plate.at(x, y, c) = scale * (y < 40 ? top : ground);
        }
    }
    return plate;
}

TEST(PlatePanorama, TheSkyIsTheFramesOrWhatTheGroundSays)
{
    const auto zenith = [](const Panorama& p) { return towards(p, 0.0, 85 * degree).g; };
    const glm::dmat3 level = look(0, 0);
    // A sky in the frame brighter than the ground needs: taken as it is.
    EXPECT_NEAR(zenith(panoramaFromPlate(scene(1.8f), 1.0, level)), 1.8, 0.1);
    // Dark trees at the top: 0.15 / 0.09.
    EXPECT_NEAR(zenith(panoramaFromPlate(scene(0.05f), 1.0, level)), 0.15 / 0.09, 0.12);
    // A sky cut off at white is taken for somewhat brighter.
    EXPECT_NEAR(zenith(panoramaFromPlate(scene(1.0f, 1.0f, 0.6f), 1.0, level)), 1.5, 0.1);
    // The same scene at night: no bright sky.
    EXPECT_LT(zenith(panoramaFromPlate(scene(0.05f, 0.02f), 1.0, level)), 0.005);
    // As the user says.
    EXPECT_NEAR(zenith(panoramaFromPlate(scene(0.05f), 1.0, level, {.skyRadiance = 3.0})), 3.0, 1e-6);
    // Below and behind: ground, and no sky.
    const Panorama p = panoramaFromPlate(scene(1.8f), 1.0, level);
    EXPECT_NEAR(towards(p, 0.0, -80 * degree).g, 0.15, 0.05);
    EXPECT_NEAR(towards(p, pi, -40 * degree).g, 0.15, 0.05);
    EXPECT_GT(towards(p, pi, 60 * degree).g, 1.0);
}

// Away from the plate, neighbours 1.4 degrees apart differ by a tenth of the plate's contrast, 0.45, at most.
TEST(PlatePanorama, TheFillHasNoSeam)
{
    const ImageF plate = flag(320, 180);
    const Panorama p = panoramaFromPlate(plate, 60 * degree, look(0.5, 0.1), {.width = 256});
    const glm::dvec3 axis = look(0.5, 0.1) * glm::dvec3(0, 0, -1);
    for (int y = 0; y < 128; ++y) {
        for (int x = 0; x < 256; ++x) {
            const glm::dvec3 d = sh::panoramaDirection(x + 0.5, y + 0.5, 256, 128);
            if (glm::dot(d, axis) > std::cos(50 * degree)) continue;
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(p.pixels.at(x, y, c), p.pixels.at((x + 1) % 256, y, c), 0.05);
                if (y + 1 < 128) {
                    EXPECT_NEAR(p.pixels.at(x, y, c), p.pixels.at(x, y + 1, c), 0.05);
                }
            }
        }
    }
}

TEST(PlatePanorama, ATurningCameraMovesTheLightSmoothly)
{
    const ImageF plate = scene(0.9f);
    const DropRadianceBaker baker({.order = DropRadianceOptions::plateOrder, .lights = false});
    DropRadiance before;
    for (int frame = 0; frame < 40; ++frame) {
        const DropRadiance now = baker.bake(panoramaFromPlate(plate, 1.0, look(0.002 * frame, 0.05 - 0.003 * frame)));
        if (frame > 0) {
            ASSERT_EQ(now.radiance.size(), before.radiance.size());
            for (std::size_t i = 0; i < now.radiance.size(); ++i) {
                ASSERT_NEAR(now.radiance.data()[i], before.radiance.data()[i], 0.01) << frame;
            }
        }
        before = now;
    }
}

TEST(PlatePanorama, AnyPlateAndCamera)
{
    ImageF broken = scene(0.9f);
    for (int y = 0; y < 60; ++y) {
        for (int x = 0; x < 100; ++x) broken.at(x, y, x % 3) = x % 2 ? nan : (y % 2 ? inf : -5.0f);
    }
    for (const ImageF& plate : {broken, ImageF(1, 1, 3, 0.5f), ImageF(3, 200, 4, 0.5f), ImageF(64, 64, 4, 0.0f)}) {
        for (const double fov : {0.5 * degree, 60 * degree, 170 * degree}) {
            for (const double pitch : {-pi / 2, 0.0, pi / 2}) {
                const Panorama p = panoramaFromPlate(plate, fov, look(0.0, pitch));
                for (const float value : p.pixels.values()) ASSERT_TRUE(std::isfinite(value) && value >= 0.0f);
            }
        }
    }
    EXPECT_THROW(panoramaFromPlate(ImageF(), 1.0, look(0, 0)), Error);
    EXPECT_THROW(panoramaFromPlate(ImageF(8, 4, 3), 0.0, look(0, 0)), Error);
    EXPECT_THROW(panoramaFromPlate(ImageF(8, 4, 3), pi, look(0, 0)), Error);
    EXPECT_THROW(panoramaFromPlate(ImageF(8, 4, 3), 1.0, look(0, 0), {.width = 8}), Error);
    EXPECT_THROW(panoramaFromPlate(ImageF(8, 4, 3), 1.0, look(0, 0), {.skyRadiance = -1.0}), Error);
}

// Premultiplied: half covered pixels are as bright as their neighbours, those without coverage are filled from them.
TEST(Panorama, AlphaIsCoverage)
{
    ImageF image(64, 32, 4, 1.0f);
    for (int y = 8; y < 16; ++y) {
        for (int x = 0; x < 32; ++x) {
            for (int c = 0; c < 4; ++c) image.at(x, y, c) = x < 8 ? 0.0f : 0.5f;
        }
    }
    PanoramaReport report;
    const Panorama p = preparePanorama(image, "p.png", &report);
    for (const float value : p.pixels.values()) ASSERT_EQ(value, 1.0f);
    EXPECT_EQ(report.transparent, 64u);
    EXPECT_EQ(report.nan, 0u);

    // Alpha that is 0 everywhere is none.
    for (std::size_t i = 3; i < image.size(); i += 4) image.data()[i] = 0.0f;
    EXPECT_EQ(preparePanorama(image, "p.png", &report).pixels.at(40, 2, 1), 1.0f);
    EXPECT_EQ(report.transparent, 0u);
}

}  // namespace
}  // namespace virga::environment
