#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "core/Error.h"
#include "depth/DepthImage.h"
#include "depth/Geometry.h"

namespace virga::depth {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
constexpr double kDegree = std::numbers::pi / 180;

ImageF imageOf(int width, std::initializer_list<float> values)
{
    ImageF image(width, int(values.size()) / width, 1);
    std::ranges::copy(values, image.values().begin());
    return image;
}

TEST(Depth, EveryValueBecomesAPositiveDepthOrSky)
{
    const ImageF stored = imageOf(4, {kNan, 0, -0.0f, -3, kInf, -kInf, 1e-45f, 65535, 1e30f, 2, 7e4f, 65504});
    for (const bool invert : {false, true})
        for (const double scale : {1.0, 1e-3, 1e6}) {
            DepthOptions options;
            options.kind = invert ? DepthKind::Inverse : DepthKind::Z;
            options.scale = scale;
            options.noValue = 65535;
            const Depth depth = sanitizeDepth(stored, options);
            for (const float metres : depth.metres.values()) EXPECT_GT(metres, 0);
            const DepthCounts& c = depth.counts;
            EXPECT_EQ(c.pixels, 12);
            EXPECT_EQ(c.nan, 1);
            EXPECT_EQ(c.noValue, 1);
            EXPECT_EQ(c.filled, c.nan + c.nonPositive + c.noValue);
        }
}

TEST(Depth, CountsWhatItFinds)
{
    DepthOptions options;
    options.scale = 0.001;
    options.noValue = 65535;
    const Depth depth = sanitizeDepth(imageOf(3, {kNan, 1000, 0, -5, kInf, 65535, 2500, 65504e3f, 4000}), options);
    EXPECT_EQ(depth.counts.nan, 1);
    EXPECT_EQ(depth.counts.nonPositive, 2);
    EXPECT_EQ(depth.counts.noValue, 1);
    EXPECT_EQ(depth.counts.infinite, 2);
    EXPECT_EQ(depth.counts.filled, 4);
    EXPECT_FLOAT_EQ(depth.metres.at(1, 0), 1);
    EXPECT_FLOAT_EQ(depth.metres.at(0, 0), 1);  // filled
    EXPECT_EQ(depth.metres.at(1, 1), kInf);

    options.kind = DepthKind::Inverse;
    options.scale = 10;
    const Depth inverse = sanitizeDepth(imageOf(3, {0, 5, -1}), options);
    EXPECT_EQ(inverse.metres.at(0, 0), kInf);
    EXPECT_FLOAT_EQ(inverse.metres.at(1, 0), 2);
    EXPECT_EQ(inverse.counts.infinite, 1);
    EXPECT_EQ(inverse.counts.nonPositive, 1);
}

// Against the search of all pixels, on scattered measurements.
TEST(Depth, HolesTakeTheNearestValue)
{
    constexpr int W = 41, H = 29;
    for (const unsigned every : {2u, 17u, 300u}) {
        ImageF stored(W, H, 1, 0.0f);
        unsigned state = 12345;
        for (float& value : stored.values()) {
            state = state * 1664525u + 1013904223u;
            if ((state >> 8) % every == 0) value = 1 + float(state >> 16);
        }
        stored.at(W / 2, H / 3) = 7;
        DepthOptions options;
        options.skyBeyond = 1e9;
        const Depth depth = sanitizeDepth(stored, options);
        for (int y = 0; y < H; ++y)
            for (int x = 0; x < W; ++x) {
                int nearest = 1 << 30;
                std::set<float> allowed;  // all that are equally near
                for (int j = 0; j < H; ++j)
                    for (int i = 0; i < W; ++i) {
                        if (stored.at(i, j) == 0) continue;
                        const int distance = (i - x) * (i - x) + (j - y) * (j - y);
                        if (distance < nearest) nearest = distance, allowed.clear();
                        if (distance == nearest) allowed.insert(stored.at(i, j));
                    }
                EXPECT_TRUE(allowed.count(depth.metres.at(x, y))) << x << " " << y;
            }
    }
    const Depth nothing = sanitizeDepth(ImageF(3, 2, 1, 0.0f));
    for (const float metres : nothing.metres.values()) EXPECT_EQ(metres, kInf);
}

TEST(Depth, RefusesWhatMakesNoSense)
{
    DepthOptions options;
    for (const double scale : {0.0, -1.0, double(kNan), double(kInf)}) {
        options.scale = scale;
        EXPECT_THROW(sanitizeDepth(ImageF(2, 2, 1, 1.0f), options), Error);
    }
    EXPECT_THROW(sanitizeDepth(ImageF()), Error);
    EXPECT_THROW(resampleDepth(sanitizeDepth(ImageF(2, 2, 1, 1.0f)), 0, 2), Error);
}

// A wall before a slope before the sky: no depth appears that is on neither.
TEST(Depth, ResamplingKeepsEdges)
{
    ImageF scene(64, 48, 1, kInf);
    for (int y = 20; y < 48; ++y)
        for (int x = 0; x < 64; ++x) scene.at(x, y) = 200.0f / float(y - 15);  // 6.25..40 m, inverse depth linear
    for (int y = 5; y < 40; ++y)
        for (int x = 10; x < 20; ++x) scene.at(x, y) = 3;
    for (const auto& [W, H] : {std::pair(150, 100), std::pair(31, 20), std::pair(64, 96), std::pair(1, 1)}) {
        const Depth depth = resampleDepth(sanitizeDepth(scene), W, H);
        EXPECT_TRUE(depth.resampled);
        ASSERT_EQ(depth.metres.width(), W);
        for (int y = 0; y < H; ++y)
            for (int x = 0; x < W; ++x) {
                const float metres = depth.metres.at(x, y);
                const double sourceY = (y + 0.5) / H * 48 - 0.5;
                const double slope = 200 / (sourceY - 15);
                EXPECT_TRUE(metres == kInf || metres == 3 || std::abs(metres / slope - 1) < 0.12)
                    << x << " " << y << " " << metres;
            }
    }
    // On the slope itself interpolation is exact.
    const Depth fine = resampleDepth(sanitizeDepth(scene), 64, 96);
    EXPECT_NEAR(fine.metres.at(40, 80), 200 / (80.5 / 2 - 0.5 - 15), 1e-5);
    const Depth same = resampleDepth(sanitizeDepth(scene), 64, 48);
    EXPECT_FALSE(same.resampled);
    EXPECT_TRUE(std::ranges::equal(same.metres.values(), scene.values()));
}

TEST(Depth, EdgesOfASmallerDepthFollowThePicture)
{
    // A dark wall before a bright sky, its edge at column 21 of 64: inside a pixel of the depth, which is half as wide.
    constexpr int W = 64, H = 8, edge = 21;
    ImageF plate(W, H, 3, 0.8f);
    for (int y = 0; y < H; ++y)
        for (int x = 0; x < edge; ++x)
            for (int c = 0; c < 3; ++c) plate.at(x, y, c) = 0.05f;
    ImageF stored(W / 2, H / 2, 1, std::numeric_limits<float>::infinity());
    for (int y = 0; y < H / 2; ++y)
        for (int x = 0; x <= edge / 2; ++x) stored.at(x, y) = 10;

    const auto wrong = [&](const Depth& depth) {
        int count = 0;
        for (int y = 0; y < H; ++y)
            for (int x = 0; x < W; ++x) count += std::isinf(depth.metres.at(x, y)) != (x >= edge);
        return count;
    };
    EXPECT_EQ(wrong(resampleDepth(sanitizeDepth(stored), W, H, plate)), 0);
    EXPECT_GT(wrong(resampleDepth(sanitizeDepth(stored), W, H)), 0);

    // A picture without contrast decides nothing: the nearest depth is taken, as without a picture.
    const Depth plain = resampleDepth(sanitizeDepth(stored), W, H, ImageF(W, H, 3, 0.5f));
    const Depth nearest = resampleDepth(sanitizeDepth(stored), W, H);
    EXPECT_TRUE(
        std::equal(plain.metres.values().begin(), plain.metres.values().end(), nearest.metres.values().begin()));
}

TEST(Depth, Statistics)
{
    const DepthStatistics s = depthStatistics(imageOf(5, {kInf, 4, 2, 9, 3}));
    EXPECT_EQ(s.min, 2);
    EXPECT_EQ(s.median, 4);
    EXPECT_EQ(s.max, 9);
    EXPECT_EQ(s.finite, 4);
    EXPECT_EQ(depthStatistics(ImageF(2, 2, 1, kInf)).median, kInf);
}

// Each point lies in the plane, `height` below the camera.
TEST(Geometry, GroundIsAPlane)
{
    constexpr int W = 90, H = 60;
    const double fov = 50 * kDegree, focal = W / 2 / std::tan(fov / 2);
    for (const double pitch : {-10 * kDegree, 0.0, 25 * kDegree, 90 * kDegree}) {
        const ImageF depth = groundDepth(W, H, fov, 1.5, pitch);
        for (int y = 0; y < H; ++y)
            for (int x = 0; x < W; ++x) {
                // The ray, turned back to a level camera: y up, looking down -z.
                const double rise = -(y + 0.5 - H / 2) / focal;
                const double worldY = rise * std::cos(pitch) - std::sin(pitch);
                if (depth.at(x, y) == kInf)
                    EXPECT_GE(worldY, -1e-12);
                else
                    EXPECT_NEAR(depth.at(x, y) * worldY, -1.5, 1e-6);
            }
    }
    // A level camera sees the horizon in the middle; straight down, the ground is a sheet at the camera's height.
    const ImageF level = groundDepth(W, H, fov, 1.5, 0);
    EXPECT_EQ(level.at(10, H / 2 - 1), kInf);
    EXPECT_LT(level.at(10, H / 2), kInf);
    const ImageF down = groundDepth(W, H, fov, 1.5, 90 * kDegree);
    for (const float metres : down.values()) EXPECT_NEAR(metres, 1.5, 1e-6);
}

TEST(Geometry, GroundFacesUpAndWallsDoNot)
{
    constexpr int W = 80, H = 60;
    const double fov = 60 * kDegree;
    for (const Vector& up : {upInCamera(0.0), upInCamera(20 * kDegree), Vector{0.3, 0.9, 0.2}}) {
        ImageF depth = groundDepth(W, H, fov, 2, up);
        for (int y = 0; y < 45; ++y)  // a board held before the camera, over ground and sky
            for (int x = 30; x < 50; ++x) depth.at(x, y) = 2;
        for (const int reach : {1, 4}) {
            const ImageF facing = upFacing(depth, fov, up, reach);
            const double length = std::sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
            for (int y = 0; y < H; ++y)
                for (int x = 0; x < W; ++x) {
                    const bool board = x >= 30 && x < 50 && y < 45;
                    const bool sky = std::isinf(depth.at(x, y));
                    const bool far = depth.at(x, y) >= 100;  // float depth is too coarse for a normal near the horizon
                    if (far && !sky) continue;
                    const double expected = board ? up[2] / length : sky ? 0 : 1;
                    EXPECT_NEAR(facing.at(x, y), expected, 1e-3) << x << " " << y;
                }
        }
    }
}

TEST(Geometry, NamesTheValueThatIsOutOfRange)
{
    EXPECT_THROW(groundDepth(0, 5, 1, 1, 0.0), Error);
    EXPECT_THROW(groundDepth(5, 5, 0, 1, 0.0), Error);
    EXPECT_THROW(groundDepth(5, 5, 4, 1, 0.0), Error);
    EXPECT_THROW(groundDepth(5, 5, 1, -1, 0.0), Error);
    EXPECT_THROW(groundDepth(5, 5, 1, kNan, 0.0), Error);
    EXPECT_THROW(groundDepth(5, 5, 1, 1, Vector{0, 0, 0}), Error);
    EXPECT_THROW(upFacing(ImageF(5, 5, 1, 1.0f), 1, Vector{0, 1, 0}, 0), Error);
}

/// The same wall, coded in each way.
TEST(DepthKinds, TheSameDepthHoweverItIsStored)
{
    constexpr int width = 33, height = 17;
    constexpr double focal = 40, baseline = 0.12;
    ImageF truth(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) truth.at(x, y) = float(2 + 0.3 * x + 0.1 * y);
    const auto expectTruth = [&](const char* what, const DepthOptions& options, auto&& store) {
        ImageF stored(width, height, 1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) stored.at(x, y) = float(store(double(truth.at(x, y)), x, y));
        const Depth depth = sanitizeDepth(stored, options);
        EXPECT_EQ(depth.counts.filled + depth.counts.infinite, 0) << what;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                ASSERT_NEAR(depth.metres.at(x, y) / truth.at(x, y), 1, 2e-6) << what << " " << x << "," << y;
    };
    DepthOptions o;
    o.scale = 0.001;
    o.offset = -1;
    expectTruth("offset", o, [](double z, int, int) { return (z + 1) / 0.001; });
    o = {};
    o.kind = DepthKind::Distance;
    o.focal_px = focal;
    expectTruth("distance", o, [](double z, int x, int y) {
        return z * std::hypot(1.0, (x + 0.5 - 0.5 * width) / focal, (y + 0.5 - 0.5 * height) / focal);
    });
    o = {};
    o.kind = DepthKind::Inverse;
    o.scale = 10;
    o.offset = 0.5;
    expectTruth("inverse", o, [](double z, int, int) { return 10 / z - 0.5; });
    o = {};
    o.kind = DepthKind::Disparity;
    o.scale = 1.0 / 256;
    o.offset = 0.25;
    o.baseline_m = baseline;
    o.focal_px = focal;
    expectTruth("disparity", o, [](double z, int, int) { return (baseline * focal / z - 0.25) * 256; });
    o = {};
    o.range = std::array{50.0, 1.0};  // white is near
    o.full = 255;
    expectTruth("range", o, [](double z, int, int) { return 255 * (z - 50) / (1 - 50); });
    o.kind = DepthKind::Inverse;
    o.full = 65535;
    expectTruth("range of the inverse", o,
                [](double z, int, int) { return 65535 * (1 / z - 1 / 50.0) / (1 - 1 / 50.0); });
}

TEST(DepthKinds, ZeroDisparityIsSkyAndNegativeIsAHole)
{
    ImageF stored(3, 1, 1);
    stored.at(0, 0) = 0;
    stored.at(1, 0) = -1;
    stored.at(2, 0) = 4;
    DepthOptions o;
    o.kind = DepthKind::Disparity;
    o.baseline_m = 0.1;
    o.focal_px = 100;
    const Depth depth = sanitizeDepth(stored, o);
    EXPECT_EQ(depth.counts.infinite, 1);
    EXPECT_EQ(depth.counts.nonPositive, 1);
    EXPECT_NEAR(depth.metres.at(2, 0), 2.5, 1e-6);
}

TEST(DepthKinds, StoredSkyIsSkyInWhateverUnit)
{
    ImageF stored(3, 1, 1);
    stored.at(0, 0) = 2000;
    stored.at(1, 0) = 65504;
    stored.at(2, 0) = 65503;
    DepthOptions o;
    o.scale = 0.001;
    o.skyStored = 65504;
    const Depth depth = sanitizeDepth(stored, o);
    EXPECT_NEAR(depth.metres.at(0, 0), 2, 1e-6);
    EXPECT_TRUE(std::isinf(depth.metres.at(1, 0)));
    EXPECT_NEAR(depth.metres.at(2, 0), 65.503, 1e-3);
    EXPECT_EQ(depth.counts.infinite, 1);
    o.kind = DepthKind::Inverse;  // large is near there
    EXPECT_FALSE(std::isinf(sanitizeDepth(stored, o).metres.at(1, 0)));
}

TEST(DepthKinds, NumbersThatMeanNothingAreRefused)
{
    const ImageF stored(2, 2, 1, 1.0f);
    const auto refused = [&](auto&& change) {
        DepthOptions o;
        o.focal_px = 100;
        o.baseline_m = 0.1;
        change(o);
        EXPECT_THROW(sanitizeDepth(stored, o), Error);
    };
    refused([](DepthOptions& o) { o.offset = std::nan(""); });
    refused([](DepthOptions& o) { o.kind = DepthKind::Disparity, o.baseline_m = 0; });
    refused([](DepthOptions& o) { o.kind = DepthKind::Distance, o.focal_px = 0; });
    refused([](DepthOptions& o) { o.range = std::array{0.0, 1.0}; });
    refused([](DepthOptions& o) { o.kind = DepthKind::Disparity, o.range = std::array{1.0, 2.0}; });
}

}  // namespace
}  // namespace virga::depth
