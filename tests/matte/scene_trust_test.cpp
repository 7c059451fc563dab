#include <gtest/gtest.h>

#include "matte/DrawnRain.h"
#include "matte/SceneTrust.h"

namespace virga {
namespace {

/// Of no trusts at all: nothing moves.
double shareUntrusted(const std::vector<ImageF>& trust)
{
    if (trust.empty()) return 0.0;
    double sum = 0, count = 0;
    for (const ImageF& image : trust)
        for (const float value : image.values()) {
            sum += value == 0.0f;
            ++count;
        }
    return sum / count;
}

TEST(SceneTrust, NoiseIsMeasuredOnTheDarkSide)
{
    for (const double noise : {0.002, 0.01, 0.05}) {
        const auto dry = test::drawRain({.strokes = 0, .noise = noise});
        EXPECT_NEAR(matte::noiseLevel(dry.frames, dry.scene) / noise, 1.0, 0.02);
        const auto wet = test::drawRain({.strokes = 30, .noise = noise});
        EXPECT_NEAR(matte::noiseLevel(wet.frames, wet.scene) / noise, 1.0, 0.05);
    }
    const auto still = test::drawRain({.strokes = 0});
    EXPECT_EQ(matte::noiseLevel(still.frames, still.scene), 0.0);
}

// Both limits are over 8 standard deviations from noise alone: none of 92,160 pixels.
TEST(SceneTrust, NoiseAndRainAreNoThings)
{
    const auto dry = test::drawRain({.strokes = 0, .noise = 0.02});
    EXPECT_EQ(shareUntrusted(matte::sceneTrust(dry.frames, dry.scene)), 0.0);
    EXPECT_FALSE(matte::somethingMoves(dry.frames, dry.scene));
    for (const double noise : {0.003, 0.01, 0.03}) {
        const auto wet = test::drawRain({.strokes = 4, .slant = 0.1, .noise = noise});
        EXPECT_LT(shareUntrusted(matte::sceneTrust(wet.frames, wet.scene)), 0.01) << noise;
    }
}

// Something 20 x 30 that walks 3 pixels a frame. Of what is bright and has nothing dark about it 16 x 16 must show.
TEST(SceneTrust, ThingsAreFoundWhetherDarkOrBright)
{
    for (const float level : {0.0f, 0.9f}) {
        auto drawn = test::drawRain({.frames = 6, .strokes = 2, .noise = 0.01});
        const auto left = [](int k) { return 30 + 3 * k; };
        for (int k = 0; k < 6; ++k)
            for (int y = 30; y < 60; ++y)
                for (int x = left(k); x < left(k) + 20; ++x)
                    for (int j = 0; j < 3; ++j) drawn.frames[std::size_t(k)].at(x, y, j) = level;
        const auto trust = matte::sceneTrust(drawn.frames, drawn.scene);
        EXPECT_TRUE(matte::somethingMoves(drawn.frames, drawn.scene));
        ASSERT_EQ(trust.size(), 6u);
        for (int k = 0; k < 6; ++k) {
            for (int y = 30; y < 60; ++y)
                for (int x = left(k); x < left(k) + 20; ++x)
                    ASSERT_EQ(trust[std::size_t(k)].at(x, y), 0.0f) << level << " " << k << " " << x << " " << y;
            // 20 x 30 and, with all margins, at most 28 x 38; beside rain that happens to stay.
            EXPECT_LT(shareUntrusted({trust[std::size_t(k)]}), 28.0 * 38 / (96 * 96) + 0.01) << level;
        }
    }
}

TEST(SceneTrust, FootageWithoutNoiseIsTrusted)
{
    const auto still = test::drawRain({.strokes = 0});
    EXPECT_EQ(shareUntrusted(matte::sceneTrust(still.frames, still.scene)), 0.0);
    EXPECT_TRUE(matte::sceneTrust({}, still.scene).empty());
    EXPECT_FALSE(matte::somethingMoves({}, still.scene));
}

}  // namespace
}  // namespace virga
