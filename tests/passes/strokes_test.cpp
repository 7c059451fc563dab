#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "Picture.h"
#include "particles/Drops.h"
#include "rainfall/DropSizes.h"

namespace virga::passes {
namespace {

using test::centroidOf;
using test::Picture;
using test::sumOf;
using test::Wanted;

constexpr double quarterPi = std::numbers::pi / 4;

class Strokes : public testing::Test {
protected:
    gl::Context context{"cpu"};
    void TearDown() override { EXPECT_NO_THROW(context.check("the test")); }
};

glm::dvec2 towards(double angle_deg) { return {std::sin(glm::radians(angle_deg)), std::cos(glm::radians(angle_deg))}; }

// A drop's disc, pi/4 w^2, is what it covers in pixels times exposures, wherever it is while the shutter is open. Long
// enough that no pixel is covered for more than the whole exposure; every matte of the atlas may come up.
TEST_F(Strokes, DepositWhatTheirDropCovers)
{
    Picture picture(200, 200, {.rain = true, .layers = true});
    for (const double width : {0.15, 0.4, 0.99, 1.01, 2.3, 5.0, 9.0, 20.0})
        for (const double angle : {0.0, 7.0, 30.0, 44.9, 45.1, 63.0, 88.0, 90.0, 180.0, 215.0}) {
            picture.constants.focus.z = 0.002f * float(1 + int(angle) % 17);  // other numbers of beads
            const double length = std::max(3.0, 3.5 * width);
            const glm::dvec2 start = glm::dvec2(100.37, 99.81) - 0.5 * length * towards(angle);
            const double sum = sumOf(picture.rainAlpha({{start, start + length * towards(angle), width}}));
            EXPECT_NEAR(sum / (quarterPi * width * width), 1, 0.01) << width << " px wide, " << angle << " deg";
        }
}

// The same with the opacity multiplier, for drops that hardly move.
TEST_F(Strokes, OpacityMultipliesAndShortPathsKeepTheirMass)
{
    Picture picture(96, 96, {.rain = true, .layers = true});
    for (const float opacity : {0.02f, 0.25f})
        for (const double width : {0.5, 3.0, 12.0})
            for (const double length : {0.0, 0.01, 0.6, 0.5 * width}) {
                picture.constants.range.w = opacity;
                const glm::dvec2 start(48.3, 44.9);
                const double sum = sumOf(picture.rainAlpha({{start, start + length * towards(20), width}}));
                EXPECT_NEAR(sum / (quarterPi * width * width * double(opacity)), 1, 0.01)
                    << width << " px wide, " << length << " px long, x " << opacity;
            }
}

TEST_F(Strokes, DefocusSpreadsAndKeepsTheMass)
{
    Picture picture(256, 256, {.rain = true, .layers = true});
    for (const double width : {0.5, 4.0})
        for (const double confusion : {0.3, 2.0, 6.0, 25.0})
            for (const double angle : {0.0, 35.0, 90.0})
                for (const double length : {10.0, 80.0}) {
                    const double depth = 2;
                    picture.constants.focus.x =
                        float(confusion / (double(Picture::focal) * std::abs(1 / depth - 0.2)));  // focused at 5 m
                    const glm::dvec2 start = glm::dvec2(128.2, 127.7) - 0.5 * length * towards(angle);
                    const ImageF alpha = picture.rainAlpha({{start, start + length * towards(angle), width, depth}});
                    EXPECT_NEAR(sumOf(alpha) / (quarterPi * width * width), 1, 0.01)
                        << width << " px, confusion " << confusion << " px, " << angle << " deg, " << length << " px";
                }
}

// Parabola of the drop's width across, variance full^2 / 20; in a pixel's column another 1/12.
TEST_F(Strokes, AreAsWideAsDropAndLensSay)
{
    Picture picture(160, 160, {.rain = true, .layers = true}, 0);
    for (const double confusion : {0.0, 4.0, 15.0}) {
        const double width = 6, depth = 2, length = 100;
        picture.constants.focus.x = float(confusion / (double(Picture::focal) * 0.3));
        const ImageF alpha = picture.rainAlpha({{{80.3, 30}, {80.3, 30 + length}, width, depth}});
        const double middle = centroidOf(alpha).x;
        double variance = 0;
        for (int y = 0; y < 160; ++y)
            for (int x = 0; x < 160; ++x) variance += double(alpha.at(x, y)) * std::pow(x + 0.5 - middle, 2);
        variance /= sumOf(alpha);
        // A round drop's chord has the variance w^2 / 16, a parabola w^2 / 20: either is right.
        const double full = std::hypot(width, confusion);
        EXPECT_GT(variance, 0.93 * full * full / 20);
        EXPECT_LT(variance, 1.07 * (full * full / 16 + 1.0 / 12));
    }
}

/// How far a stroke's centroid may be off [px]. What is narrower than a pixel and falls into one whole is found in its
/// middle, up to half of what is left of it away; a parabola as narrow as a pixel, shared out over whole pixels, is up
/// to 0.096 px from its middle; one of 2 px under 0.02.
double placeTolerance(double width) { return width < 1 ? 0.1 + 0.5 * (1 - width) : width < 2 ? 0.1 : 0.05; }

// A stroke thinner than a pixel that moves by fractions of one must not flicker.
TEST_F(Strokes, NeverAlias)
{
    Picture picture(64, 64, {.rain = true, .layers = true});
    for (const double width : {0.2, 0.6})
        for (const double length : {2.0, 11.3})
            for (const double angle : {0.0, 17.0, 45.0, 90.0}) {
                double least = 1e9, most = 0;
                for (int step = 0; step < 16; ++step) {
                    const glm::dvec2 start = glm::dvec2(30, 25) + glm::dvec2(step % 4, step / 4) / 4.0;
                    const double sum = sumOf(picture.rainAlpha({{start, start + length * towards(angle), width}}));
                    least = std::min(least, sum);
                    most = std::max(most, sum);
                }
                EXPECT_LT((most - least) / most, 0.01)
                    << width << " px wide, " << length << " long, " << angle << " deg";
            }
}

TEST_F(Strokes, LieWhereTheirPathLies)
{
    Picture picture(96, 96, {.rain = true, .layers = true}, 0);
    for (const double width : {0.4, 3.0, 8.0})
        for (const double angle : {0.0, 25.0, 60.0, 90.0, 200.0})
            for (const double shift : {0.0, 0.25, 0.7}) {
                const glm::dvec2 middle(48 + shift, 47.1 - 0.5 * shift), half = 12.0 * towards(angle);
                const glm::dvec2 found = centroidOf(picture.rainAlpha({{middle - half, middle + half, width}}));
                EXPECT_LT(glm::length(found - middle), placeTolerance(width))
                    << width << " px wide, " << angle << " deg";
            }
}

// Drops of a real field, turbulence and all: the device's hash, cells and waves against the CPU's.
TEST_F(Strokes, TheDeviceFindsTheDropsOfTheCpu)
{
    Picture picture(320, 240, {.rain = true, .layers = true}, 0);
    const rainfall::DropSizes sizes(25);
    const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(),
                                     particles::Motion({.wind = {3, 1}, .gust = 1, .turbulence = 0.7, .seed = 9}), 5);
    particles::Exposure exposure;
    exposure.open_s = 1234.5;
    exposure.duration_s = 0.004;
    exposure.projection = camera::projectionFromFocal(320, 240, double(Picture::focal));
    picture.constants.focus.z = 0.004f;
    const auto list = field.cellsInView(exposure, {.near_m = 1, .far_m = 6, .threshold = 1e-4});
    int compared = 0;
    for (std::size_t c = 0; c < list.cells.size() && compared < 40; c += 13) {
        particles::CellList alone = list;
        alone.cells = {list.cells[c]};
        alone.cells[0].key.w = 0;
        alone.blocks = {0};
        alone.drops = 1;
        const shared::Drop drop = shared::dropInCell(alone.cells[0], list.classes[alone.cells[0].key.z], list.waves[0],
                                                     list.waves[1], list.waves[2], list.waves[3], 0);
        const auto start = camera::project(exposure.projection, glm::dvec3(drop.open)),
                   end = camera::project(exposure.projection, glm::dvec3(drop.close));
        const auto within = [](const camera::Projected& p) {
            return p.depth > 1 && p.px.x > 12 && p.px.x < 308 && p.px.y > 12 && p.px.y < 228;
        };
        if (!within(start) || !within(end)) continue;
        const ImageF alpha = picture.rainAlpha(alone);
        ASSERT_EQ(picture.strokeCount(), 1u);
        const double width = double(Picture::focal) * double(drop.diameter) / (0.5 * (start.depth + end.depth));
        EXPECT_LT(glm::length(centroidOf(alpha) - 0.5 * (start.px + end.px)), placeTolerance(width));
        EXPECT_NEAR(sumOf(alpha) / (quarterPi * width * width), 1, 0.015);
        ++compared;
    }
    EXPECT_GE(compared, 30);
}

// Strokes that the device keeps: no visible one less, and none that is more than its margin of a pixel or two outside.
TEST_F(Strokes, TheDeviceKeepsWhatShows)
{
    Picture picture(320, 240, {.rain = true, .layers = true, .cameraMotion = true});
    const rainfall::DropSizes sizes(25);
    const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(),
                                     particles::Motion({.wind = {8, 1}, .turbulence = 0.7, .seed = 9}), 5);
    particles::Exposure exposure;
    exposure.open_s = 77;
    exposure.duration_s = 0.02;
    exposure.projection = camera::projectionFromFocal(320, 240, double(Picture::focal));
    exposure.poseAtOpen.worldFromCamera = camera::rotationZXY(-0.2, 0.6, 0.1);
    exposure.poseAtClose.worldFromCamera = camera::rotationZXY(-0.19, 0.63, 0.12);
    exposure.poseAtClose.position = {0.1, 0, -0.2};
    const particles::Visibility visibility = {.near_m = 0.5, .far_m = 9, .threshold = 2e-4};
    const auto turned = [](const camera::Pose& pose) {
        return glm::mat4(glm::mat3(glm::transpose(pose.worldFromCamera)));
    };
    picture.constants.cameraFromWorldOpen = turned(exposure.poseAtOpen);
    picture.constants.cameraFromWorldClose = turned(exposure.poseAtClose);
    picture.constants.range = {0.5f, 9, 2e-4f, 1};
    picture.constants.focus.z = 0.02f;
    const auto list = field.cellsInView(exposure, visibility);
    picture.rainAlpha(list);
    std::size_t inside = 0, around = 0;
    for (const auto& drop : particles::test::dropsOf(list)) {
        const double speed = field.classOf(drop.dropClass).speed;
        inside += particles::test::isVisible(drop, speed, exposure, visibility, 0.01);
        around += particles::test::isVisible(drop, speed, exposure, visibility, -1.01);
    }
    ASSERT_GT(inside, 1000u);
    EXPECT_GE(picture.strokeCount(), inside);
    // The device compares boxes: a slanted stroke may pass a corner. Those are few.
    EXPECT_LE(double(picture.strokeCount()), 1.02 * double(around));
}

TEST_F(Strokes, AreHiddenBehindWhatIsNearer)
{
    Picture picture(64, 64, {.rain = true, .depth = true, .layers = true});
    ImageF depth(64, 64, 1, INFINITY);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 30; ++x) depth.at(x, y) = 5;
    const std::vector<Wanted> across = {{{8, 20.5}, {56, 20.5}, 3, 10}, {{8, 44.5}, {56, 44.5}, 3, 4.9}};
    picture.targets.uploadDepth(test::uniform(64, 64, 1, INFINITY));
    const ImageF free = picture.rainAlpha(across);
    picture.targets.uploadDepth(depth);
    const ImageF hidden = picture.rainAlpha(across);
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 64; ++x) {
            const bool behind = x < 30 && y < 32;
            EXPECT_EQ(hidden.at(x, y), behind ? 0.0f : free.at(x, y)) << x << ", " << y;
        }
    EXPECT_GT(free.at(20, 20), 0);

    // One that flies away through a wall: seen until it reaches it.
    picture.targets.uploadDepth(test::uniform(64, 64, 1, 8));
    const ImageF through = picture.rainAlpha({{{20, 8}, {44, 56}, 2, 4, 16}});
    EXPECT_GT(through.at(21, 10), 0);
    EXPECT_EQ(through.at(42, 53), 0);
}

// Sums of integers: whatever the order in which drops are listed and the device adds them, the same bits.
TEST_F(Strokes, OrderDoesNotShow)
{
    Picture picture(128, 96, {.rain = true, .fog = true, .layers = true});
    picture.targets.uploadFogTable(std::vector<float>(shared::fogTableSize, 0.3f));
    const rainfall::DropSizes sizes(60);
    const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(), particles::Motion({}), 5);
    particles::Exposure exposure;
    exposure.duration_s = 0.01;
    exposure.projection = camera::projectionFromFocal(128, 96, double(Picture::focal));
    const auto list = field.cellsInView(exposure, {.near_m = 0.5, .far_m = 12, .threshold = 1e-4});
    particles::CellList reversed = list;
    reversed.cells.clear();
    reversed.blocks.clear();
    std::uint32_t drops = 0;
    for (std::size_t c = list.cells.size(); c-- > 0;) {
        reversed.cells.push_back(list.cells[c]);
        reversed.cells.back().key.w = drops;
        drops += list.dropsIn(c);
    }
    std::size_t cell = 0;
    for (std::uint32_t drop = 0; drop < drops; drop += shared::dropsPerBlock) {
        while (cell + 1 < reversed.cells.size() && reversed.cells[cell + 1].key.w <= drop) ++cell;
        reversed.blocks.push_back(std::uint32_t(cell));
    }
    const ImageF plate = test::opaque(128, 96, 0.1f, 0.2f, 0.3f);
    const ImageF first = picture.render(plate, list), second = picture.render(plate, list),
                 backwards = picture.render(plate, reversed);
    EXPECT_GT(picture.strokeCount(), 3000u);
    EXPECT_TRUE(std::equal(first.values().begin(), first.values().end(), second.values().begin()));
    EXPECT_TRUE(std::equal(first.values().begin(), first.values().end(), backwards.values().begin()));
}

// Transmittances multiply: two strokes over each other let through what one does of what the other does.
TEST_F(Strokes, BlendAsIndependentVeils)
{
    Picture picture(64, 64, {.rain = true, .layers = true}, 0);
    picture.constants.range.w = 0.6f;
    const Wanted down = {{32.5, 8}, {32.5, 56}, 20}, across = {{8, 32.5}, {56, 32.5}, 16};
    const ImageF a = picture.rainAlpha({down}), b = picture.rainAlpha({across});
    const ImageF both = picture.rainAlpha({down, across});
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        most = std::max(most, double(both.data()[i]));
        EXPECT_NEAR(1 - both.data()[i], (1 - a.data()[i]) * (1 - b.data()[i]), 1e-5);
    }
    EXPECT_GT(most, 0.3);
}

// The sums are in fixed point: however many strokes lie on a pixel and however opaque, they do not wrap around.
TEST_F(Strokes, TenThousandOnOnePixelHideItAndNoMore)
{
    Picture picture(48, 48, {.rain = true, .layers = true}, 0);
    for (const float opacity : {0.01f, 1.0f, 100.0f}) {
        picture.constants.range.w = opacity;
        double before = 0;
        for (const int count : {1, 100, 10'000, 100'000}) {
            const ImageF alpha =
                picture.rainAlpha(std::vector<Wanted>(std::size_t(count), Wanted{{24.5, 8}, {24.5, 40}, 9}));
            const double now = alpha.at(24, 24);
            EXPECT_GE(now, before) << count << " strokes of opacity " << opacity;
            before = now;
            for (const float value : alpha.values()) ASSERT_TRUE(value >= 0 && value <= 1) << value;
        }
        EXPECT_GT(before, 0.999) << opacity;
    }
}

TEST_F(Strokes, NoDropsNoRain)
{
    Picture picture(32, 32, {.rain = true, .layers = true});
    const ImageF plate = test::opaque(32, 32, 0.25f, 0.5f, 2.0f);
    const ImageF beauty = picture.render(plate);
    EXPECT_EQ(picture.strokeCount(), 0u);
    EXPECT_TRUE(std::equal(beauty.values().begin(), beauty.values().end(), plate.values().begin()));
}

TEST_F(Strokes, NearestDepthAndMotionBelongToOneStroke)
{
    Picture picture(64, 64, {.rain = true, .layers = true, .nearest = true});
    picture.render(ImageF(64, 64, 4), picture.listOf({{{32.5, 10}, {32.5, 50}, 6, 7}, {{10, 32.5}, {54, 32.5}, 6, 3}}));
    const ImageF depth = picture.targets.readNearestDepth(), motion = picture.targets.readNearestMotion();
    EXPECT_NEAR(depth.at(32, 20), 7, 1e-4);
    EXPECT_NEAR(depth.at(32, 32), 3, 1e-4);
    EXPECT_EQ(depth.at(5, 5), INFINITY);
    EXPECT_NEAR(motion.at(32, 20, 1), 40, 0.05);
    EXPECT_NEAR(motion.at(20, 32, 0), 44, 0.05);
    EXPECT_EQ(motion.at(5, 5, 0), 0);
}

// Places where formulas could break: paths of no length, along rows, through the camera's near limit, far outside.
TEST_F(Strokes, NothingIsEverNaN)
{
    Picture picture(48, 48, {.rain = true, .fog = true, .depth = true, .boost = true, .layers = true});
    picture.constants.boost.x = 0.7f;
    std::vector<float> table(shared::fogTableSize);
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = 0.1f * float(i);
    picture.targets.uploadFogTable(table);
    ImageF depth(48, 48, 1, 1e-30f);
    for (int i = 0; i < 48 * 24; ++i) depth.data()[i] = i % 2 ? INFINITY : 1e30f;
    picture.targets.uploadDepth(depth);
    ImageF plate = test::opaque(48, 48, 1e6f, -3, 0);
    for (int x = 0; x < 48; ++x) plate.at(x, 7, 3) = 0;
    const auto list = picture.listOf({{{20, 20}, {20, 20}, 5},
                                      {{20, 20}, {20, 20}, 1e-4},
                                      {{0, 0}, {48, 48}, 1e3},
                                      {{-1e6, 5}, {1e6, 6}, 2},
                                      {{5, -1e6}, {6, 1e6}, 2},
                                      {{24, 24}, {24, 25}, 0.5, 0.011},
                                      {{10, 10}, {11, 30}, 1, 1e3, 1},
                                      {{30, 10}, {30, 10.0001}, 40}});
    const auto expectFinite = [](const ImageF& image) {
        for (const float value : image.values()) ASSERT_TRUE(std::isfinite(value));
    };
    expectFinite(picture.render(plate, list));
    for (const auto layer : {FrameTargets::LayerIndex::Rain, FrameTargets::LayerIndex::Fog})
        expectFinite(picture.targets.readLayer(layer));
}

}  // namespace
}  // namespace virga::passes
