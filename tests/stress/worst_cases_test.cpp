// The worst inputs by name.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "optics/DropTransfer.h"
#include "sh/Harmonics.h"
#include "shot/Parameters.h"
#include "shot/RainModel.h"
#include "stress/Run.h"
#include "stress/Worst.h"
#include "support/Files.h"

namespace virga::stress {
namespace {

using shot::Settings;
using test::TemporaryFolder;

constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();

std::string uniformPanorama(const TemporaryFolder& folder, int width, int height, float light)
{
    io::writeExr(folder / "env.exr", ImageF(width, height, 3, light), {"R", "G", "B"}, false);
    return folder / "env.exr";
}

double largest(const ImageF& pixels, int channel)
{
    double most = 0;
    for (int y = 0; y < pixels.height(); ++y)
        for (int x = 0; x < pixels.width(); ++x) most = std::max(most, double(pixels.at(x, y, channel)));
    return most;
}

// The basis grows without bound towards the poles, and so do the terms of the transfer function's series at its own
// poles, the rainbows and the glory.
TEST(WorstCases, PolesOfTheTransferFunctionAtOrdersUpTo256)
{
    constexpr int order = 256;
    for (const double away : {0.0, 1e-300, 1e-12, 1e-6, 1e-3})
        for (const double pole : {1.0, -1.0}) {
            const auto values = sh::basis(order, glm::normalize(glm::dvec3(away, pole, 0.5 * away)));
            for (int l = 0; l <= order; ++l) {
                double sum = 0;  // Unsoeld 1927: (2 l + 1) / (4 pi) in every direction
                for (int m = -l; m <= l; ++m) sum += std::pow(values[sh::coefficientIndex(l, m)], 2);
                ASSERT_NEAR(sum * 4 * std::numbers::pi / (2 * l + 1), 1, 1e-9) << l << " " << away << " " << pole;
            }
        }
    for (const double index : {1.331, 1.338, 1.1, 2.4}) {
        const auto f = optics::zonalCoefficients(order, {.index = index});
        EXPECT_NEAR(f[0], 1, 1e-12);
        for (const double coefficient : f) ASSERT_LE(std::abs(coefficient), 1 + 1e-12);
        const optics::RingTransfer ring({.index = index});
        for (int i = 0; i <= 7200; ++i) {
            const double mean = ring.mean(i * std::numbers::pi / 7200, 0.125 * std::numbers::pi / 180);
            ASSERT_TRUE(std::isfinite(mean) && mean >= 0) << i;
        }
    }
}

TEST(WorstCases, EnvironmentsOf1e9)
{
    const TemporaryFolder folder;
    for (const float light : {1e9f, 0.0f}) {
        Worst worst;
        worst.settings.env = uniformPanorama(folder, 32, 16, light);
        worst.settings.darken = worst.settings.desaturate = 0;
        worst.plate = light;
        worst.ceiling.light = light;
        const io::RenderedFrame frame = worst.render();
        EXPECT_GT(worst.statistics.strokes, 0u);
        // Through drops a white world is white.
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(frame.beauty.at(16, 8, c), light, 2e-3 * light);
    }
}

TEST(WorstCases, ASunOf1e9InOnePixel)
{
    const TemporaryFolder folder;
    for (const int row : {0, 7, 15, 31}) {
        ImageF sky(64, 32, 3, 0.1f);
        for (int c = 0; c < 3; ++c) sky.at(40, row, c) = 1e9f;
        io::writeExr(folder / "env.exr", sky, {"R", "G", "B"}, false);
        for (const double order : {0.0, 12.0, 128.0}) {
            Worst worst;
            worst.settings.env = folder / "env.exr";
            worst.settings.envOrder = order;
            worst.ceiling.light = 1e9;
            worst.render();
            EXPECT_GT(worst.statistics.strokes, 0u);
        }
    }
}

TEST(WorstCases, AnEnvironmentOfOnePixel)
{
    const TemporaryFolder folder;
    Worst worst;
    worst.settings.darken = worst.settings.desaturate = 0;
    worst.settings.env = uniformPanorama(folder, 1, 1, 0.5f);
    EXPECT_NEAR(worst.render().beauty.at(16, 8, 1), 0.5, 1e-3);
}

// What is too bright for half goes out as the most that half holds, not as infinity.
TEST(WorstCases, HalfOverflow)
{
    const TemporaryFolder folder;
    Worst worst;
    worst.settings.env = uniformPanorama(folder, 32, 16, 1e9f);
    worst.plate = 65504;
    worst.ceiling.light = 1e9;
    io::RenderedFrame frame = worst.render();
    EXPECT_GT(largest(frame.beauty, 1), 65504);
    io::writeExr(folder / "half.exr", frame.beauty, {"R", "G", "B", "A"}, true);
    const ImageF read = io::readRawImage(folder / "half.exr").pixels;
    EXPECT_EQ(largest(read, 1), 65504);
    for (const float value : read.values()) ASSERT_TRUE(std::isfinite(value));
}

TEST(WorstCases, TenThousandStrokesOnOnePixel)
{
    for (const double strokes : {1e4, 3e5}) {
        Worst worst;
        worst.shot.width = worst.shot.height = 1;
        worst.settings.strokes = strokes;
        worst.settings.opacity = 100;
        worst.settings.threshold = 1e-5;
        const io::RenderedFrame frame = worst.render();
        EXPECT_GT(worst.statistics.strokes, strokes / 3);
        EXPECT_GT(frame.layers[0].pixels.at(0, 0, 3), 0.1) << "of the rain";
    }
}

TEST(WorstCases, DropsThroughTheCamera)
{
    const TemporaryFolder folder;
    for (const char* track : {"0 0 0 0 0 0 0 60\n1 0 0 -1 0 0 0 60\n", "0 0 0 0 0 0 0 60\n1 0 0 1 0 0 0 60\n",
                              "0 0 0 0 90 0 0 60\n1 0 4 0 90 30 0 60\n"}) {
        Worst worst;
        worst.settings.camera = folder.write("through.chan", track);
        worst.settings.near_m = 0.01;
        worst.settings.far_m = 2;
        worst.settings.threshold = 1e-4;
        worst.settings.shutter_deg = 180;
        worst.render();
        EXPECT_GT(worst.statistics.strokes, 100u) << track;
    }
}

TEST(WorstCases, NearOf1em6AndFarOf1e9)
{
    Worst worst;
    for (const auto& [name, value] : {std::pair{"near", "1e-6"}, std::pair{"far", "1e9"}}) {
        Settings settings;
        const auto set = [&] { shot::setFromText(settings, shot::findParameter(name), value); };
        EXPECT_SAYS(test::sentenceOf(ErrorCode::InvalidArgument, set), "must be");
    }
    // Whoever sets them past the table meets the same laws.
    worst.settings.strokes = 1000;
    worst.settings.near_m = 1e-6;
    worst.isRendered();
    worst.settings.far_m = 1e9;
    worst.isRendered();
    worst.settings.near_m = 0.01;
    worst.settings.far_m = 1e6;
    EXPECT_TRUE(worst.isRendered()) << "the ends of the table";
}

TEST(WorstCases, SpeedsOf0And1e4)
{
    const TemporaryFolder folder;
    for (const double speed : {0.0, 100.0, 1500.0}) {  // times 7 m/s or so; 1500 is beyond the table
        Worst worst;
        worst.settings.speed = speed;
        worst.settings.threshold = 1e-6;  // a fast drop hides next to nothing
        worst.settings.strokes = 300;
        worst.settings.gust_m_s = worst.settings.turbulence_m_s = 0;
        worst.render();
        EXPECT_GT(worst.statistics.strokes, 50u) << speed;
    }
    Worst worst;
    worst.settings.camera = folder.write("fast.chan", "0 0 0 0 0 0 0 60\n1 417 0 0 0 0 0 60\n");  // 1e4 m/s at 24 fps
    worst.settings.far_m = 20;
    worst.settings.threshold = 0.02;
    EXPECT_TRUE(worst.isRendered());
}

// A frame costs and shows what any other does: as many strokes, but not the same.
TEST(WorstCases, FramesOfPlusAndMinus1e9)
{
    std::size_t strokes = 0;
    ImageF first;
    for (const FrameNumber frame : {0L, 1'000'000'000L, -1'000'000'000L}) {
        Worst worst;
        worst.frame = frame;
        worst.settings.strokes = 1000;
        const io::RenderedFrame made = worst.render();
        if (frame == 0) {
            strokes = worst.statistics.strokes;
            first = made.layers[0].pixels;
            ASSERT_GT(strokes, 100u);
            continue;
        }
        // Two Poisson numbers; six deviations.
        EXPECT_NEAR(double(worst.statistics.strokes), double(strokes), 6 * std::sqrt(2.0 * double(strokes)));
        EXPECT_NE(std::memcmp(made.layers[0].pixels.data(), first.data(), first.size() * sizeof(float)), 0);
    }
}

TEST(WorstCases, FramesASecondOf1em3And1e5)
{
    for (const double fps : {1e-3, 1e5})
        for (const FrameNumber frame : {0L, 1'000'000'000L}) {
            Worst worst;
            worst.shot.fps = fps;
            worst.frame = frame;
            EXPECT_TRUE(worst.isRendered()) << fps;
            worst.settings.shutter_deg = 180;  // up to 500 s
            worst.isRendered();
        }
}

TEST(WorstCases, DepthOfNanZeroNegativeAndInfinityInACheckerboard)
{
    const TemporaryFolder folder;
    ImageF checks(33, 17, 1);
    const float odd[] = {nan, 0, -1, inf, 8};
    for (int y = 0; y < 17; ++y)
        for (int x = 0; x < 33; ++x) checks.at(x, y) = odd[(x + 2 * y) % 5];
    io::writeExr(folder / "z.exr", checks, {"Z"}, false);
    for (const char* kind : {"z", "distance", "inverse"}) {
        Worst worst;
        worst.settings.depth = folder / "z.exr";
        worst.settings.depthKind = kind;
        worst.settings.splashes = 100;
        worst.settings.blur_px = 50;
        worst.render();
        EXPECT_GT(worst.statistics.depthCounts.filled, 0u);
    }
}

TEST(WorstCases, FieldsOfViewOf01And179Degrees)
{
    for (const double fov : {0.1, 179.0}) {
        Worst worst;
        worst.settings.fov_deg = fov;
        worst.isRendered();  // at 0.1 degrees f/8 is an aperture of 2 m, and every drop nearby is a veil before it
        worst.settings.fstop = 1000;
        EXPECT_TRUE(worst.isRendered()) << fov;
        worst.settings.ground = "1.7,30";
        EXPECT_TRUE(worst.isRendered()) << fov;
    }
}

TEST(WorstCases, ACamera1e7MetresFromTheOrigin)
{
    const TemporaryFolder folder;
    std::size_t strokes[2];
    for (int far = 0; far < 2; ++far) {
        Worst worst;
        worst.settings.strokes = 1000;
        worst.settings.camera = folder.write("far.chan", far ? "0 1e7 1e7 -1e7 0 0 0 40\n" : "0 0 0 0 0 0 0 40\n");
        worst.render();
        strokes[far] = worst.statistics.strokes;
    }
    EXPECT_NEAR(double(strokes[0]), double(strokes[1]), 6 * std::sqrt(2.0 * double(strokes[0])));
}

TEST(WorstCases, PicturesOfOnePixelAndOf16384)
{
    for (const auto& [width, height] : {std::pair{1, 1}, std::pair{1, 64}, std::pair{16384, 16}, std::pair{3, 16384}}) {
        Worst worst;
        worst.shot.width = width;
        worst.shot.height = height;
        worst.settings.ground = "1.7,10";
        worst.settings.blur_px = 2;
        worst.layers = width < 16384;
        EXPECT_TRUE(worst.isRendered()) << width << "x" << height;
    }
}

// Only at length: 268 million pixels take gigabytes and a while. Strips of that size are above.
TEST(WorstCases, APictureOf16384Squared)
{
    if (!isLong()) GTEST_SKIP() << "scripts/stress.sh renders it";
    Worst worst;
    worst.shot.width = worst.shot.height = 16384;
    worst.settings.strokes = 1000;
    worst.layers = false;
    EXPECT_TRUE(worst.isRendered());
    EXPECT_GT(worst.statistics.strokes, 100u);
}

// Places and times beyond what 64 bits count still have splashes of their own.
TEST(WorstCases, SplashesHoweverFarAndLate)
{
    Settings settings;
    particles::Exposure exposure;
    exposure.projection = camera::projectionFromHorizontalFov(33, 17, 1);
    const shot::RainModel rain(settings, exposure);
    const auto keyOf = [&](double x, double z, double time) {
        exposure.open_s = time;
        exposure.duration_s = 0;
        exposure.poseAtOpen.position = {x, 2, z};
        shared::FrameConstants constants{};
        rain.describeSplashes(constants, exposure, settings);
        return std::array{constants.splashKey.y, constants.splashKey.z, constants.splashTime.x};
    };
    const auto here = keyOf(0.1, 0.1, 0.01), behind = keyOf(-0.1, -0.1, -0.01);
    for (int i = 0; i < 3; ++i) {
        EXPECT_EQ(here[std::size_t(i)], 0u);
        EXPECT_EQ(behind[std::size_t(i)], 0xffffffffu);
    }
    const auto far = keyOf(1.3e22, -1.7e22, 1.1e21), farther = keyOf(1.9e22, -1.9e22, 1.9e21);
    for (int i = 0; i < 3; ++i) EXPECT_NE(far[std::size_t(i)], farther[std::size_t(i)]) << i;
    keyOf(-1e300, 1e300, 1e300);
}

TEST(WorstCases, AlphaOfExactly0And1)
{
    Worst worst;
    worst.settings.opacity = 0;
    worst.settings.fog_1_m = 0;
    worst.settings.darken = 0.5;
    for (const float alpha : {0.0f, 1.0f}) {
        worst.alpha = worst.plate = alpha;
        worst.ceiling.light = 1;
        worst.isOpaque = alpha == 1;
        const io::RenderedFrame nothing = worst.render();
        for (int x = 0; x < 33; ++x) EXPECT_EQ(nothing.beauty.at(x, 3, 3), alpha) << "no stroke, no alpha";
    }
    worst.settings = {};
    worst.settings.opacity = 100;
    worst.settings.strokes = 1e4;
    worst.settings.sky = 0.7;
    worst.settings.fog_1_m = 1000;
    for (const float alpha : {0.0f, 0.5f, 1.0f}) {
        worst.alpha = alpha;
        worst.plate = 0.5f * alpha;
        worst.isOpaque = alpha == 1;
        const io::RenderedFrame covered = worst.render();
        EXPECT_GT(covered.beauty.at(16, 8, 3), 0.99) << "rain and fog cover what is not there";
    }
}

TEST(WorstCases, ShutterOf0)
{
    Worst worst;
    worst.settings.shutter_deg = 0;
    worst.settings.strokes = 1000;
    const io::RenderedFrame frame = worst.render();
    EXPECT_GT(worst.statistics.strokes, 100u);
    const io::Layer& motion = frame.layers.back();
    ASSERT_EQ(motion.name, "rain.motion");
    for (const float value : motion.pixels.values()) ASSERT_EQ(value, 0) << "nothing moves";
}

}  // namespace
}  // namespace virga::stress
