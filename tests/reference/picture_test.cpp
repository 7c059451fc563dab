// The whole reference picture, by the laws of docs/design.md.
#include "reference/Picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/Error.h"
#include "core/Parallel.h"
#include "rainfall/DropSizes.h"
#include "rainfall/SizeClasses.h"
#include "reference/DepthBlur.h"
#include "reference/UndrawnRain.h"

namespace virga::reference {
namespace {

constexpr int width = 40, height = 30;

particles::RainField fieldOf(double rate)
{
    const rainfall::DropSizes sizes(rate);
    return {rainfall::makeSizeClasses(sizes), sizes.slope(), particles::Motion({.turbulence = 0.25}), 7};
}

Radiance uniform(double value)
{
    return [value](std::span<const glm::dvec3> d) { return std::vector<glm::dvec3>(d.size(), glm::dvec3(value)); };
}

Scene sceneOf(const particles::RainField& field)
{
    Scene scene;
    scene.exposure.duration_s = 0.005;
    scene.exposure.open_s = 3;
    scene.exposure.projection = camera::projectionFromHorizontalFov(width, height, 1.0);
    scene.focalAtClose_px = scene.exposure.projection.focal_px;
    scene.rain.field = &field;
    scene.rain.visibility = {.near_m = 0.5, .far_m = 8, .threshold = 0.002};
    scene.rain.samples = 8;
    scene.dropLight = scene.behind = uniform(1);
    return scene;
}

ImageF plateOf(float value)
{
    ImageF plate(width, height, 4, value);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) plate.at(x, y, 3) = 1;
    return plate;
}

double meanOf(const ImageD& image, int channel)
{
    double sum = 0;
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) sum += image.at(x, y, channel);
    return sum / (double(image.width()) * image.height());
}

TEST(Picture, WithoutRainIsThePlate)
{
    Scene scene = sceneOf(fieldOf(25));
    scene.rain.field = nullptr;
    ImageF plate = plateOf(0.3f);
    plate.at(3, 4, 1) = 1e5f;
    const Picture picture = render(scene, plate, {});
    for (std::size_t i = 0; i < plate.size(); ++i) EXPECT_EQ(float(picture.beauty.data()[i]), plate.data()[i]);
    EXPECT_EQ(picture.strokes, 0u);
}

TEST(Picture, InAWhiteWorldNothingIsSeen)
{
    const particles::RainField field = fieldOf(50);
    Scene scene = sceneOf(field);
    scene.air.opticalDepth = [](double depth) { return 0.01 * std::min(depth, 100.0); };
    scene.rain.opacity = 5;
    const Picture picture = render(scene, plateOf(1), {});
    EXPECT_GT(meanOf(picture.rain, 3), 0.01);
    EXPECT_GT(meanOf(picture.fog, 3), 0.1);
    for (const double value : picture.beauty.values()) EXPECT_NEAR(value, 1, 1e-12);
}

// Energy: as many drops as the rate has, each with its own shadow. What a frustum's rain covers on average is the
// extinction of the drops times the way, and the noise of so many drops is known: 4 sigma.
TEST(Picture, RainCoversWhatItsShadowsCover)
{
    const rainfall::DropSizes sizes(25);
    const particles::RainField field = fieldOf(25);
    Scene scene = sceneOf(field);
    scene.rain.opacity = 0.01;  // strokes do not hide each other
    scene.rain.samples = 4;
    double covered = 0;
    constexpr int frames = 6;
    for (int i = 0; i < frames; ++i) {
        scene.exposure.open_s = 2.0 * i;
        covered += meanOf(render(scene, plateOf(0), {}).rain, 3) / 0.01 / frames;
    }
    const double least = field.classes().front().d0;
    const double way = scene.rain.visibility.far_m - scene.rain.visibility.near_m;
    const double expected = sizes.extinction(1.0, least) * way;
    // Of one drop at z: pi/4 (f D / z)^2 px of width x height; the mean square over the frustum.
    const double f = scene.exposure.projection.focal_px;
    const double square = std::pow(std::numbers::pi / 4, 2) * f * f * sizes.moment(4, least, 1) / (width * height) *
                          (1 / scene.rain.visibility.near_m - 1 / scene.rain.visibility.far_m);
    const double sigma = std::sqrt(square / frames);
    EXPECT_LT(sigma, 0.2 * expected);
    EXPECT_NEAR(covered, expected, 4 * sigma) << expected << " +- " << sigma;
}

TEST(Picture, NearerStrokesHideFartherOnes)
{
    // All drops alike and opaque: what shows is the nearest's colour where one covers the pixel whole.
    const particles::RainField field = fieldOf(100);
    Scene scene = sceneOf(field);
    scene.rain.opacity = 1e4;
    scene.rain.visibility.far_m = 3;
    scene.air.opticalDepth = [](double depth) { return depth; };  // the share of fog in front tells the depth
    scene.air.color = glm::dvec3(0.0);
    const Picture picture = render(scene, plateOf(0), {});
    int whole = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (picture.rain.at(x, y, 3) < 1) continue;
            ++whole;
            EXPECT_LE(picture.rain.at(x, y, 0), std::exp(-picture.nearestDepth.at(x, y)) * 1.01);
        }
    EXPECT_GT(whole, width * height / 20);
}

TEST(Picture, IsTheSameOnAnyNumberOfThreads)
{
    const particles::RainField field = fieldOf(25);
    const Scene scene = sceneOf(field);
    const Picture many = render(scene, plateOf(0.2f), {});
    const ThreadLimit one(1);
    const Picture single = render(scene, plateOf(0.2f), {});
    EXPECT_TRUE(std::equal(many.beauty.values().begin(), many.beauty.values().end(), single.beauty.values().begin()));
    EXPECT_EQ(many.strokes, single.strokes);
}

TEST(Picture, SaysHowFarItCanGo)
{
    const particles::RainField field = fieldOf(25);
    Scene scene = sceneOf(field);
    scene.rain.visibility.far_m = 200;
    try {
        render(scene, plateOf(0), {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("--far 200"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("lower --far to"), std::string::npos) << error.what();
    }
}

TEST(UndrawnRain, IsWhatTheFieldSays)
{
    const rainfall::DropSizes sizes(25);
    const particles::RainField field = fieldOf(25);
    for (const double threshold : {1e-4, 0.004, 0.02, 0.3})
        for (const double depth : {1.0, 7.0, 60.0, 500.0}) {
            const particles::Visibility v = {.near_m = 0.8, .far_m = 200, .threshold = threshold};
            const double ours = undrawnOpticalDepth(depth, sizes, field, v, false, 400, 0.005);
            EXPECT_NEAR(field.undrawnOpticalDepth(depth, 400, 0.005, v, sizes.extinction(1.0)), ours, 0.01 * ours)
                << threshold << " " << depth;
        }
}

TEST(UndrawnRain, ThinnedStrokesLeaveWhatTheFieldSays)
{
    const rainfall::DropSizes sizes(25);
    const particles::RainField field = fieldOf(25);
    std::vector<double> depths;
    for (int i = 1; i <= 400; ++i) depths.push_back(0.25 * i);
    for (const double thin : {0.01, 0.2})
        for (const double exposure_s : {0.0, 0.005, 0.05}) {
            const particles::Visibility v = {.near_m = 0.8, .far_m = 80, .threshold = 0.0015, .thin = thin};
            const auto ours = thinnedOpticalDepths(depths, sizes, field, v, 400, exposure_s);
            for (std::size_t i = 9; i < depths.size(); i += 30)
                EXPECT_NEAR(field.thinnedOpticalDepth(depths[i], 400, exposure_s, v), ours[i], 0.01 * ours.back())
                    << thin << ", " << exposure_s << " s, " << depths[i] << " m";
            EXPECT_GT(ours.back(), 0);
        }
}

TEST(UndrawnRain, IsTheSmallestDropsWhereAllAreDrawn)
{
    const rainfall::DropSizes sizes(25);
    const particles::RainField field = fieldOf(25);
    const particles::Visibility v = {.near_m = 0.8, .far_m = 200, .threshold = 0.02};
    EXPECT_NEAR(undrawnOpticalDepth(30, sizes, field, v, true, 400, 0.005), 30 * sizes.extinction(1, 0, 3e-4), 1e-12);
}

TEST(DepthBlur, KeepsAUniformPictureAndSpreadsAPoint)
{
    ImageD flat(31, 31, 4, 0.5), point(31, 31, 4);
    const ImageD same = depthBlur(flat, {}, 2, 50);
    for (const double value : same.values()) EXPECT_NEAR(value, 0.5, 1e-12);
    point.at(15, 15, 0) = 1;
    const ImageD spread = depthBlur(point, {}, 2, 50);
    double sum = 0, variance = 0;
    for (int y = 0; y < 31; ++y)
        for (int x = 0; x < 31; ++x) {
            sum += spread.at(x, y, 0);
            variance += spread.at(x, y, 0) * (x - 15) * (x - 15);
        }
    EXPECT_NEAR(sum, 1, 1e-4);
    EXPECT_NEAR(variance, 4, 1e-2);
}

TEST(DepthBlur, WhatIsSharpDoesNotBleed)
{
    ImageD image(30, 8, 4);
    ImageF depth(30, 8, 1, 1e4f);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 15; ++x) {
            image.at(x, y, 0) = 1;  // near, bright and sharp
            depth.at(x, y) = 0.1f;
        }
    const ImageD blurred = depthBlur(image, depth, 3, 50);
    EXPECT_EQ(blurred.at(14, 4, 0), 1);
    EXPECT_LT(blurred.at(15, 4, 0), 1e-4);
}

}  // namespace
}  // namespace virga::reference
