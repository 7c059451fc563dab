// One drop on the picture: what it covers is known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "matte/OscillatingDrops.h"
#include "optics/DropOscillation.h"
#include "reference/DropSampler.h"

namespace virga::reference {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int width = 48, height = 40;
constexpr double focal = 500;

Scene sceneOf(int samples)
{
    Scene scene;
    scene.exposure.projection = {width, height, focal};
    scene.exposure.duration_s = 0.005;
    scene.focalAtClose_px = focal;
    scene.rain.samples = samples;
    scene.rain.visibility = {.near_m = 0.1, .far_m = 100, .threshold = 0.002};
    return scene;
}

/// A drop `wide` px wide at `depth` that goes straight over the picture.
DropPath drop(glm::dvec2 start, glm::dvec2 end, double wide, double depth = 5, double depthEnd = 0)
{
    if (depthEnd == 0) depthEnd = depth;
    DropPath path;
    path.moments = DropPath::most;
    for (int i = 0; i < path.moments; ++i) {
        const double t = double(i) / (path.moments - 1), z = depth + t * (depthEnd - depth);
        const glm::dvec2 px = (start * (1 - t) * depth + end * t * depthEnd) / z;
        path.at[std::size_t(i)] = {
            {(px.x - width / 2.0) * z / focal, (height / 2.0 - px.y) * z / focal, -z}, px, z, focal};
    }
    path.diameter = wide * depth / focal;
    path.look = 0x12345678u;
    path.id = 42;
    return path;
}

ImageD alphaOf(const Scene& scene, const DropPath& path, ConstImageViewF depth = {})
{
    ImageD alpha(width, height, 1);
    std::vector<Fragment> fragments;
    DropSampler(scene, SamplerTables(scene), depth).sample(path, 0, height, fragments);
    for (const Fragment& f : fragments) alpha.data()[f.pixel] = f.alpha;
    return alpha;
}

double sumOf(const ImageD& image)
{
    double sum = 0;
    for (const double value : image.values()) sum += value;
    return sum;
}

double rmsOf(const ImageD& a, const ImageD& b)
{
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow(a.data()[i] - b.data()[i], 2);
    return std::sqrt(sum / double(a.size()));
}

/// Share of the exposure for which a drop of width w, that goes straight down by `length` from (0, 0), covers a place.
double coveredAt(glm::dvec2 place, double w, double length)
{
    const double r = 0.5 * w;
    if (std::abs(place.x) >= r) return 0;
    const double half = std::sqrt(r * r - place.x * place.x);
    return std::max(0.0, std::min(length, place.y + half) - std::max(0.0, place.y - half)) / length;
}

TEST(DropSampler, ADropCoversItsDiscTimesTheExposure)
{
    const matte::StrokeAtlas atlas = matte::makeOscillatingDropAtlas(1);
    for (const bool mattes : {false, true})
        for (const double wide : {0.1, 0.7, 3.0, 9.0})
            for (const glm::dvec2 end : {glm::dvec2(24.3, 12.2), glm::dvec2(26, 25), glm::dvec2(12, 14)}) {
                Scene scene = sceneOf(16);
                if (mattes) scene.rain.atlas = &atlas;
                scene.rain.opacity = 0.3;
                const double covered = 0.3 * pi / 4 * wide * wide;
                EXPECT_NEAR(sumOf(alphaOf(scene, drop({24.3, 12.2}, end, wide))), covered, 0.01 * covered)
                    << wide << " to " << end.x << " " << mattes;
            }
}

TEST(DropSampler, OutOfFocusToo)
{
    Scene scene = sceneOf(16);
    scene.rain.aperture_m = 0.02;
    scene.rain.inverseFocus_1_m = 1.0 / 50;  // a circle of 1.8 px at 5 m
    EXPECT_NEAR(sumOf(alphaOf(scene, drop({24, 14}, {24, 24}, 1))), pi / 4, 1e-3);
    // A point that stands still is the circle itself.
    const ImageD point = alphaOf(scene, drop({24.5, 20.5}, {24.5, 20.5}, 1e-3));
    EXPECT_NEAR(point.at(24, 20) / sumOf(point), 1 / (pi / 4 * 1.8 * 1.8), 0.02);
}

TEST(DropSampler, StandingStillItIsADisc)
{
    const ImageD alpha = alphaOf(sceneOf(32), drop({24.5, 20.5}, {24.5, 20.5}, 11));
    EXPECT_NEAR(alpha.at(24, 20), 1, 0.03);
    EXPECT_NEAR(alpha.at(24 + 4, 20), 1, 0.03);
    EXPECT_EQ(alpha.at(24 + 6, 20), 0);
    EXPECT_NEAR(sumOf(alpha), pi / 4 * 121, 1);
}

TEST(DropSampler, MovingItIsTheTimeForWhichItCovers)
{
    const double wide = 5, length = 14;
    const ImageD alpha = alphaOf(sceneOf(64), drop({24.2, 12.4}, {24.2, 12.4 + length}, wide));
    constexpr int parts = 40;
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double mean = 0;
            for (int j = 0; j < parts; ++j)
                for (int i = 0; i < parts; ++i)
                    mean += coveredAt({x + (i + 0.5) / parts - 24.2, y + (j + 0.5) / parts - 12.4}, wide, length) /
                            (parts * parts);
            worst = std::max(worst, std::abs(mean - alpha.at(x, y)));
        }
    EXPECT_LT(worst, 2e-3);  // of 0.36
}

// A way from far to near: the drop is wide where it is near, and spends its time where perspective has it.
TEST(DropSampler, PerspectiveMovesTheMassAndKeepsIt)
{
    const DropPath path = drop({24, 8}, {24, 32}, 2, 4, 1);
    const ImageD alpha = alphaOf(sceneOf(32), path);
    // pi/4 (f D / z)^2, z from 4 to 1 at an even pace: the mean of 1/z^2 is 1 / (4 * 1).
    const double covered = pi / 4 * std::pow(focal * path.diameter, 2) / 4;
    EXPECT_NEAR(sumOf(alpha), covered, 0.01 * covered);
    double near = 0;
    for (int y = 20; y < height; ++y)
        for (int x = 0; x < width; ++x) near += alpha.at(x, y);
    // On the middle of the picture's way z = 1.6; the share of 1/z^2 beyond it is (1 - 1/1.6) / (1 - 1/4).
    EXPECT_NEAR(near / covered, 0.5, 0.02);
}

// The mattes of drops that do not oscillate are what moving discs leave.
TEST(DropSampler, APlainMatteIsADisc)
{
    const matte::StrokeAtlas plain = matte::makeOscillatingDropAtlas(1, {.groups = 1, .variants = 2, .liveliness = 0});
    Scene scene = sceneOf(32);
    const DropPath any = drop({20.3, 8}, {20.3, 9}, 1.3);
    const float beads = float(optics::oscillationFrequency(2, any.diameter) * scene.exposure.duration_s);
    const int worn =
        matte::strokeLayer(plain, beads, matte::oscillationStrength(float(any.diameter)), shared::unitFloat(any.look));
    // As long as the matte was made for.
    const double length = 1.3 * (double(plain.mattes[std::size_t(worn)].lengthDiameters) - 1);
    const DropPath path = drop({20.3, 8}, {20.3 + 0.25 * length, 8 + std::sqrt(1 - 0.0625) * length}, 1.3);
    const ImageD disc = alphaOf(scene, path);
    scene.rain.atlas = &plain;
    EXPECT_LT(rmsOf(alphaOf(scene, path), disc), 0.05 * rmsOf(disc, ImageD(width, height, 1)));
}

TEST(DropSampler, ErrorFallsFasterThanTheSamplesGrow)
{
    const DropPath path = drop({19.3, 9.1}, {27.7, 28.4}, 2.6);
    const ImageD truth = alphaOf(sceneOf(256), path);
    const auto error = [&](int samples) { return rmsOf(alphaOf(sceneOf(samples), path), truth); };
    const double coarse = error(4), middle = error(16), fine = error(64);
    EXPECT_LT(middle, coarse / 5) << coarse << " " << middle;
    EXPECT_LT(fine, middle / 5) << middle << " " << fine;
    // The stated error of the default.
    EXPECT_LT(middle, 0.02 * rmsOf(truth, ImageD(width, height, 1)));
}

TEST(DropSampler, MirroredWaysGiveMirroredPictures)
{
    const Scene scene = sceneOf(64);
    const ImageD left = alphaOf(scene, drop({15, 10}, {20, 30}, 3)),
                 right = alphaOf(scene, drop({width - 15.0, 10}, {width - 20.0, 30}, 3));
    double worst = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) worst = std::max(worst, std::abs(left.at(x, y) - right.at(width - 1 - x, y)));
    EXPECT_LT(worst, 2e-3);
}

TEST(DropSampler, WhatIsBehindAThingIsHidden)
{
    ImageF depth(width, height, 1, 10);
    for (int y = 0; y < height; ++y)
        for (int x = 24; x < width; ++x) depth.at(x, y) = 3;  // nearer than the drop
    const ImageD alpha = alphaOf(sceneOf(16), drop({12, 20}, {36, 20}, 2), depth);
    EXPECT_GT(alpha.at(20, 20), 0.05);
    EXPECT_EQ(alpha.at(24, 20), 0);
    // One that comes from behind the thing shows from where it is in front of it: z = 3 at a third of its way's depths.
    const ImageD through = alphaOf(sceneOf(16), drop({30, 5}, {30, 35}, 1, 4, 2), depth);
    EXPECT_EQ(through.at(29, 10), 0);
    EXPECT_GT(through.at(29, 32) + through.at(30, 32), 0.01);
}

TEST(DropSampler, LampsShineInDropsInFrontOfThem)
{
    Scene scene = sceneOf(8);
    scene.lamps = {{{0, 0, -20}, {100, 50, 0}, 0.2}};
    std::vector<Fragment> fragments;
    DropSampler(scene, SamplerTables(scene), {}).sample(drop({24, 15}, {24, 25}, 1), 0, height, fragments);
    ASSERT_FALSE(fragments.empty());
    EXPECT_GT(fragments[0].lamps.x, 0);
    EXPECT_NEAR(fragments[0].lamps.y / fragments[0].lamps.x, 0.5, 0.05);  // but for dispersion
    EXPECT_EQ(fragments[0].lamps.z, 0);
    const double without = fragments[0].lamps.x;
    scene.lamps[0].intensity *= 3;
    fragments.clear();
    DropSampler(scene, SamplerTables(scene), {}).sample(drop({24, 15}, {24, 25}, 1), 0, height, fragments);
    EXPECT_NEAR(fragments[0].lamps.x, 3 * without, 1e-9 * without);
}

}  // namespace
}  // namespace virga::reference
