#include <gtest/gtest.h>

#include <random>

#include "core/Parallel.h"
#include "matte/DrawnRain.h"
#include "matte/DryScene.h"
#include "matte/Pictures.h"
#include "matte/TemporalMedian.h"
#include "support/Scores.h"

namespace virga {
namespace {

using matte::DryScene;
using matte::dryScene;
using test::drawRain;
using test::rootMeanSquare;

/// Of samples that rain covers.
double wetShare(const std::vector<ImageF>& alphas)
{
    double wet = 0, count = 0;
    for (const ImageF& alpha : alphas) {
        for (const float a : alpha.values()) wet += a > 0.02f;
        count += double(alpha.size());
    }
    return wet / count;
}

/// Root mean square of a - b over the pixels of a rectangle.
double errorIn(const ImageF& a, const ImageF& b, int left, int top, int right, int bottom)
{
    double square = 0, count = 0;
    for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x)
            for (int j = 0; j < a.channels(); ++j, ++count)
                square += std::pow(double(a.at(x, y, j)) - b.at(x, y, j), 2);
    return std::sqrt(square / count);
}

/// A block of one level that walks `step` pixels a frame, from column 2 on.
void walk(std::vector<ImageF>& frames, int width, int height, int top, int step, float level)
{
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const int left = 2 + int(k) * step;
        for (int y = top; y < top + height; ++y)
            for (int x = left; x < std::min(left + width, frames[k].width()); ++x)
                for (int j = 0; j < frames[k].channels(); ++j) frames[k].at(x, y, j) = level;
    }
}

// Where half of the samples are wet the median lies between dry and wet, the mean of what is dry does not: measured is
// a twelfth of the median's error.
TEST(DryScene, SettlesOnTheDryHalfOfTheSamples)
{
    for (const int strokes : {92, 108})
        for (const unsigned seed : {1u, 2u}) {
            const auto drawn =
                drawRain({.frames = 20, .strokes = strokes, .slant = 0.12, .noise = 2.0 / 255, .seed = seed});
            ASSERT_GT(wetShare(drawn.alphas), 0.47);
            const DryScene dry = dryScene(drawn.frames, true, {}, {});
            const double median = rootMeanSquare(matte::temporalMedian(drawn.frames), drawn.scene);
            EXPECT_LT(rootMeanSquare(dry.scene, drawn.scene), 0.2 * median) << strokes << ' ' << seed;
            EXPECT_LT(rootMeanSquare(dry.scene, drawn.scene), 2.0 / 255) << strokes << ' ' << seed;
            EXPECT_NEAR(dry.noise.typical * 255 / 2, 1.0, 0.1) << strokes << ' ' << seed;
            EXPECT_FALSE(dry.hasMovers) << strokes << ' ' << seed;
        }
}

// The mean of n values is known to sigma / sqrt(n); what is trimmed, and a little rain that is not, take their share.
TEST(DryScene, IsNearlyAsGoodAsTheMeanOfDryFrames)
{
    for (const double noise : {0.004, 0.012, 0.03}) {
        const auto drawn = drawRain({.frames = 16, .strokes = 10, .slant = -0.2, .noise = noise});
        const DryScene dry = dryScene(drawn.frames, true, {}, {});
        EXPECT_FALSE(dry.hasMovers);
        EXPECT_TRUE(dry.trust.empty());
        EXPECT_LT(rootMeanSquare(dry.scene, drawn.scene), 1.5 * noise / std::sqrt(16.0)) << noise;
    }
}

// Of four frames all are asked for the noise, of nine every second, which backwards are the same: then nothing but the
// order of sums is left. Of twelve in any order others are asked, and a few values at the limits change sides.
TEST(DryScene, TheOrderOfFramesDoesNotMatterWhereNothingMoves)
{
    for (const int count : {4, 9, 12}) {
        const double noise = 0.008;
        const auto drawn = drawRain({.frames = count, .strokes = 8, .noise = noise});
        std::vector<ImageF> other = drawn.frames;
        if (count == 12)
            std::shuffle(other.begin(), other.end(), std::mt19937(3));
        else
            std::reverse(other.begin(), other.end());
        const DryScene a = dryScene(drawn.frames, true, {}, {}), b = dryScene(other, true, {}, {});
        EXPECT_LT(rootMeanSquare(a.scene, b.scene), count == 12 ? 0.1 * noise : 0.003 * noise) << count;
    }
}

TEST(DryScene, GrowsWithTheFootage)
{
    const auto drawn = drawRain({.frames = 8, .strokes = 12, .noise = 0.008});
    const DryScene one = dryScene(drawn.frames, true, {}, {});
    for (const float factor : {1e-3f, 1e4f}) {
        const auto frames = test::changed(drawn.frames, [&](const ImageF& f) { return test::scaled(f, factor); });
        const DryScene many = dryScene(frames, true, {}, {});
        EXPECT_LT(rootMeanSquare(test::scaled(many.scene, 1 / factor), one.scene), 0.01 * 0.008);
        EXPECT_NEAR(many.range / factor / one.range, 1.0, 1e-5);
        EXPECT_NEAR(many.noise.typical / factor / one.noise.typical, 1.0, 1e-3);
    }
    // The 99th percentile of the true scene, within the noise.
    std::vector<float> values(drawn.scene.values().begin(), drawn.scene.values().end());
    std::sort(values.begin(), values.end());
    EXPECT_NEAR(one.range, values[(values.size() - 1) * 99 / 100], 0.01);
}

// Dark, then bright: the scene where it walked is as good as in the rows that it never met, but for the frames that it
// took: 20 of 16 x 4 columns, so 3 or 4 of 14 at most.
TEST(DryScene, WhatWalksThroughIsNotInIt)
{
    for (const float level : {0.02f, 0.95f}) {
        auto drawn = drawRain({.frames = 14, .strokes = 4, .noise = 0.008});
        walk(drawn.frames, 20, 30, 30, 5, level);
        const DryScene dry = dryScene(drawn.frames, true, {}, {});
        ASSERT_TRUE(dry.hasMovers) << level;
        ASSERT_EQ(dry.trust.size(), drawn.frames.size());
        EXPECT_LT(errorIn(dry.scene, drawn.scene, 2, 30, 87, 60), 1.6 * errorIn(dry.scene, drawn.scene, 0, 66, 96, 96))
            << level;
        for (std::size_t k = 0; k < drawn.frames.size(); ++k)
            EXPECT_EQ(dry.trust[k].at(2 + 5 * int(k) + 10, 45), 0.0f) << level << ' ' << k;
    }
}

TEST(DryScene, FewerThanFiveFramesAreAllTrusted)
{
    auto drawn = drawRain({.frames = 4, .strokes = 2, .noise = 0.008});
    walk(drawn.frames, 20, 30, 30, 15, 0.02f);
    const DryScene dry = dryScene(drawn.frames, true, {}, {});
    EXPECT_FALSE(dry.hasMovers);
    EXPECT_TRUE(dry.trust.empty());
    auto more = drawRain({.frames = 6, .strokes = 2, .noise = 0.008});
    walk(more.frames, 20, 30, 30, 10, 0.02f);
    EXPECT_TRUE(dryScene(more.frames, true, {}, {}).hasMovers);
    EXPECT_FALSE(dryScene(more.frames, false, {}, {}).hasMovers);
}

TEST(DryScene, NothingMovesLaterWhereNothingMovedBefore)
{
    auto drawn = drawRain({.frames = 8, .strokes = 2, .noise = 0.008});
    DryScene dry = dryScene(drawn.frames, true, {}, {});
    ASSERT_FALSE(dry.hasMovers);
    walk(drawn.frames, 20, 30, 30, 8, 0.02f);
    matte::renewTrust(drawn.frames, dry.scene, {}, dry);
    EXPECT_FALSE(dry.hasMovers);
    EXPECT_TRUE(dry.trust.empty());
}

// Frame k has no picture in its first 3 k columns, as where a camera turns. What stands there instead does not count.
TEST(DryScene, WhatIsNotCoveredIsNotInIt)
{
    for (const float instead : {0.0f, 0.5f}) {
        auto drawn = drawRain({.frames = 10, .strokes = 4, .noise = 0.008});
        std::vector<ImageF> covered;
        for (int k = 0; k < 10; ++k) {
            ImageF& there = covered.emplace_back(96, 96, 1, 1.0f);
            for (int y = 0; y < 96; ++y)
                for (int x = 0; x < 3 * k; ++x) {
                    there.at(x, y) = 0;
                    for (int j = 0; j < 3; ++j) drawn.frames[std::size_t(k)].at(x, y, j) = instead;
                }
        }
        const DryScene dry = dryScene(drawn.frames, true, {}, covered);
        // From column 9 on there are 4 frames at least, and they are the greater part from column 15 on.
        EXPECT_LT(errorIn(dry.scene, drawn.scene, 15, 0, 27, 96), 0.008) << instead;
        EXPECT_LT(errorIn(dry.scene, drawn.scene, 27, 0, 96, 96), 0.004) << instead;
        EXPECT_LT(std::abs(dry.noise.typical / 0.008 - 1), 0.1) << instead;
        ASSERT_EQ(dry.trust.size(), covered.size());
        for (std::size_t k = 0; k < covered.size(); ++k)
            for (std::size_t i = 0; i < covered[k].size(); ++i) ASSERT_LE(dry.trust[k].data()[i], covered[k].data()[i]);
    }
}

// The same where what stands there instead is so near to the scene that nothing else tells it apart.
TEST(DryScene, WhatIsNotCoveredIsNotInItHoweverNear)
{
    auto drawn = drawRain({.frames = 12, .strokes = 0, .noise = 0.008});
    std::vector<ImageF> covered(12, ImageF(96, 96, 1, 1.0f));
    for (std::size_t k = 0; k < 5; ++k)
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 30; ++x) {
                covered[k].at(x, y) = 0;
                for (int j = 0; j < 3; ++j) drawn.frames[k].at(x, y, j) = drawn.scene.at(x, y, j) + 0.01f;
            }
    const DryScene dry = dryScene(drawn.frames, false, {}, covered);
    double off = 0;
    for (int y = 0; y < 96; ++y)
        for (int x = 0; x < 30; ++x)
            for (int j = 0; j < 3; ++j)
                off += double(dry.scene.at(x, y, j) - drawn.scene.at(x, y, j)) / (96.0 * 30 * 3);
    EXPECT_LT(std::abs(off), 0.002);
}

// Rain that covers a place in three frames of four: told from frames before.
TEST(DryScene, AStartIsKeptWhereItIsDry)
{
    auto drawn = drawRain({.frames = 12, .strokes = 0, .noise = 0.006});
    for (std::size_t k = 0; k < 12; ++k)
        if (k % 4 != 0)
            for (int y = 20; y < 60; ++y)
                for (int x = 40; x < 43; ++x)
                    for (int j = 0; j < 3; ++j) {
                        float& value = drawn.frames[k].at(x, y, j);
                        value = 0.7f * value + 0.3f * 0.8f;
                    }
    const double without = errorIn(dryScene(drawn.frames, false, {}, {}).scene, drawn.scene, 40, 20, 43, 60);
    const double with = errorIn(dryScene(drawn.frames, false, drawn.scene, {}).scene, drawn.scene, 40, 20, 43, 60);
    EXPECT_LT(with, 0.006);
    EXPECT_GT(without, 5 * with);
}

TEST(DryScene, ThreadsDoNotShow)
{
    auto drawn = drawRain({.frames = 8, .strokes = 12, .noise = 0.008});
    walk(drawn.frames, 20, 30, 30, 8, 0.02f);
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        return dryScene(drawn.frames, true, {}, {});
    };
    const DryScene one = run(1), many = run(0);
    EXPECT_EQ(test::largestDifference(one.scene, many.scene), 0.0);
    EXPECT_EQ(test::largestDifference(one.noise.sigma, many.noise.sigma), 0.0);
    EXPECT_EQ(test::largestDifference(one.trust, many.trust), 0.0);
}

}  // namespace
}  // namespace virga
