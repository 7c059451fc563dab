#include <gtest/gtest.h>

#include <random>

#include "matte/DrawnRain.h"
#include "matte/DryScene.h"
#include "matte/NoiseMap.h"
#include "matte/Pictures.h"

namespace virga {
namespace {

using matte::darkDeviation;
using matte::NoiseMap;
using matte::noiseMap;
using test::drawRain;

/// The middles of `count` equal shares of |x|, x normal with this deviation.
std::vector<float> halfNormal(double sigma, int count)
{
    std::vector<float> depths;
    double low = 0;
    for (int n = 0; n < count; ++n) {
        const double wanted = (n + 0.5) / count;
        double high = 6;
        while (high - low > 1e-9) {
            const double middle = 0.5 * (low + high);
            (std::erf(middle / std::sqrt(2.0)) < wanted ? low : high) = middle;
        }
        depths.push_back(float(sigma * low));
    }
    return depths;
}

// Whatever share is left out as repeated, up to the 90 % that it stands for.
TEST(DarkDeviation, IsThatOfTheNormalWhateverIsLeftOut)
{
    for (const double sigma : {1e-5, 0.01, 300.0})
        for (const double repeated : {0.0, 0.2, 0.7, 1.2}) {
            std::vector<float> depths = halfNormal(sigma, 4000);
            EXPECT_NEAR(darkDeviation(depths, repeated * sigma) / sigma, 1.0, 0.02) << sigma << ' ' << repeated;
        }
}

TEST(DarkDeviation, IsNothingWithoutDepths)
{
    std::vector<float> none, few(63, 0.1f), enough(64, 0.1f), equal(1000, 0.0f), shallow(1000, 0.001f);
    EXPECT_EQ(darkDeviation(none, 0.0), 0.0);
    EXPECT_EQ(darkDeviation(few, 0.0), 0.0);
    EXPECT_NEAR(darkDeviation(enough, 0.0), 0.1 / 0.6745, 1e-3);
    EXPECT_EQ(darkDeviation(equal, 0.0), 0.0);
    EXPECT_EQ(darkDeviation(shallow, 0.002), 0.0);
}

// Beside the mean of the frames, which lies nearer to them than the truth does. A typical deviation is the median of 36
// of a block's, each from over a thousand depths: by chance within 1 %.
TEST(NoiseMap, IsTheNoiseAboutTheMean)
{
    for (const int count : {3, 5, 10, 20}) {
        const auto drawn = drawRain({.frames = count, .strokes = 0, .noise = 2.0 / 255});
        ImageF mean(96, 96, 3);
        for (const ImageF& frame : drawn.frames)
            for (std::size_t i = 0; i < mean.size(); ++i) mean.data()[i] += frame.data()[i] / float(count);
        EXPECT_NEAR(noiseMap(drawn.frames, {}, mean, 1e-6, 0.0).typical * 255 / 2, 1.0, 0.03) << count;
    }
}

// A scene that was trimmed lies nearer still to what was kept, and a little low, so that 3 % are missing of 20 frames
// and 8 % of 10; rain takes no more.
TEST(NoiseMap, IsTheNoiseThatWasDrawn)
{
    for (const int frames : {10, 15, 20})
        for (const double noise : {1.0 / 255, 2.0 / 255, 3.0 / 255})
            for (const int strokes : {0, 12}) {
                const auto drawn = drawRain({.frames = frames, .strokes = strokes, .slant = 0.1, .noise = noise});
                const NoiseMap map = matte::dryScene(drawn.frames, true, {}, {}).noise;
                EXPECT_GT(map.typical / noise, frames == 10 ? 0.90 : 0.93) << frames << ' ' << noise << ' ' << strokes;
                EXPECT_LT(map.typical / noise, 1.02) << frames << ' ' << noise << ' ' << strokes;
                for (const float sigma : map.sigma.values())
                    EXPECT_NEAR(sigma / noise, 1.0, 0.25) << frames << ' ' << noise << ' ' << strokes;
            }
}

// Seven of ten blocks are those of the frame before, which leaves six pictures of a block in 20 frames. Beside their
// mean nothing is missing; a trimmed scene is up to 16 % too near to so few.
TEST(NoiseMap, SeesTheNoiseBetweenRepeatedBlocks)
{
    const double noise = 2.0 / 255;
    for (const unsigned seed : {1u, 2u, 3u}) {
        auto drawn = drawRain({.frames = 20, .strokes = 0, .noise = noise, .seed = seed});
        std::mt19937 engine(seed);
        test::repeatBlocks(drawn.frames, 0.7, [&] { return double(engine() >> 8) / double(1 << 24); });
        ImageF mean(96, 96, 3);
        for (const ImageF& frame : drawn.frames)
            for (std::size_t i = 0; i < mean.size(); ++i) mean.data()[i] += frame.data()[i] / 20;
        EXPECT_NEAR(noiseMap(drawn.frames, {}, mean, 1e-6, 0.0).typical / noise, 1.0, 0.1) << seed;
        const double found = matte::dryScene(drawn.frames, true, {}, {}).noise.typical / noise;
        EXPECT_GT(found, 0.80) << seed;
        EXPECT_LT(found, 1.05) << seed;
    }
    // Frames that stand still but for three: half and more of the values are the scene's, which says nothing of the
    // noise.
    const auto drawn = drawRain({.frames = 9, .strokes = 0, .noise = noise});
    std::vector<ImageF> frames(9, drawn.scene);
    for (const std::size_t k : {2u, 4u, 6u}) frames[k] = drawn.frames[k];
    EXPECT_NEAR(noiseMap(frames, {}, drawn.scene, 1e-6, 0.1 * noise).typical / noise, 1.0, 0.1);
}

TEST(NoiseMap, KnowsWhereItIs)
{
    auto drawn = drawRain({.width = 90, .height = 70, .frames = 12, .strokes = 0, .noise = 0.004});
    const auto noisier = drawRain({.width = 90, .height = 70, .frames = 12, .strokes = 0, .noise = 0.012, .seed = 2});
    for (std::size_t k = 0; k < 12; ++k)
        for (int y = 0; y < 70; ++y)
            for (int x = 48; x < 90; ++x)
                for (int j = 0; j < 3; ++j) drawn.frames[k].at(x, y, j) = noisier.frames[k].at(x, y, j);
    const NoiseMap map = noiseMap(drawn.frames, {}, drawn.scene, 1e-6, 0.0);
    EXPECT_EQ(map.sigma.width(), 6);
    EXPECT_EQ(map.sigma.height(), 5);
    EXPECT_NEAR(map.at(0, 0) / 0.004, 1.0, 0.2);
    EXPECT_NEAR(map.at(47, 69) / 0.004, 1.0, 0.2);
    EXPECT_NEAR(map.at(48, 0) / 0.012, 1.0, 0.2);
    EXPECT_NEAR(map.at(89, 69) / 0.012, 1.0, 0.3);
}

// A block that is still, one whose noise is not trusted, and footage that has none.
TEST(NoiseMap, HasAFloor)
{
    auto drawn = drawRain({.width = 64, .height = 48, .frames = 10, .strokes = 0, .noise = 0.01});
    std::vector<ImageF> trust(10, ImageF(64, 48, 1, 1.0f));
    for (std::size_t k = 0; k < 10; ++k)
        for (int y = 0; y < 16; ++y)
            for (int x = 0; x < 64; ++x)
                for (int j = 0; j < 3; ++j) {
                    float& value = drawn.frames[k].at(x, y, j);
                    if (x < 16) value = drawn.scene.at(x, y, j);
                    if (x >= 16 && x < 32) value = drawn.scene.at(x, y, j) - 0.0002f * float(1 + (x + y) % 7);
                    if (x >= 32) value = 0;
                    if (x >= 32) trust[k].at(x, y) = 0;
                }
    const NoiseMap map = noiseMap(drawn.frames, trust, drawn.scene, 1e-6, 0.0);
    EXPECT_NEAR(map.typical / 0.01, 1.0, 0.1);
    EXPECT_EQ(map.at(0, 0), float(map.typical));
    EXPECT_EQ(map.at(16, 0), float(0.25 * map.typical));
    EXPECT_EQ(map.at(40, 0), float(map.typical));

    const std::vector<ImageF> still(10, drawn.scene);
    const NoiseMap none = noiseMap(still, {}, drawn.scene, 1e-4, 0.0);
    EXPECT_EQ(none.typical, 1e-4);
    for (const float sigma : none.sigma.values()) EXPECT_EQ(sigma, 1e-4f);
    const NoiseMap least = noiseMap(drawn.frames, trust, drawn.scene, 0.5, 0.0);
    for (const float sigma : least.sigma.values()) EXPECT_EQ(sigma, 0.5f);
}

}  // namespace
}  // namespace virga
