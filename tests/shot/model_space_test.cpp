#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "shot/EnvironmentColor.h"
#include "shot/ModelSpace.h"

namespace virga::shot {
namespace {

TEST(ModelSpace, NamesComeBack)
{
    for (const ModelSpace space : {ModelSpace::Linear, ModelSpace::Display}) {
        const auto named = modelSpaceNamed(nameOf(space));
        ASSERT_TRUE(named);
        EXPECT_EQ(*named, space);
    }
    for (const char* word : {"", "Linear", "display ", "srgb"}) EXPECT_FALSE(modelSpaceNamed(word)) << word;
}

TEST(ModelSpace, ThereAndBackIsTheSame)
{
    ImageF image(100, 3, 3);
    for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = -0.2f + 0.01f * float(i);
    ImageF linear = image, display = image;
    toModel(linear, ModelSpace::Linear);
    fromModel(linear, ModelSpace::Linear);
    EXPECT_EQ(std::memcmp(linear.data(), image.data(), image.size() * sizeof(float)), 0);
    toModel(display, ModelSpace::Display);
    for (std::size_t i = 0; i < image.size(); ++i) {
        const double l = image.data()[i];
        if (l < 0 || l > 1) continue;
        // IEC 61966-2-1.
        EXPECT_NEAR(display.data()[i], l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055, 1e-5);
    }
    fromModel(display, ModelSpace::Display);
    for (std::size_t i = 0; i < image.size(); ++i)
        EXPECT_NEAR(display.data()[i], image.data()[i], 1e-5 * std::max(1.0f, image.data()[i]));
}

/// Still footage of every brightness from `low` to `high`, with noise of one deviation.
std::vector<ImageF> ramp(float low, float high, float noise, int count = 10)
{
    std::mt19937 engine(5);
    std::normal_distribution<float> normal(0, noise);
    std::vector<ImageF> frames(std::size_t(count), ImageF(64, 40, 3));
    for (ImageF& frame : frames)
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 64; ++x)
                for (int j = 0; j < 3; ++j)
                    frame.at(x, y, j) = low + (high - low) * float(x) / 63 + (noise > 0 ? normal(engine) : 0.0f);
    return frames;
}

// A median of about 3,000 depths a step is known to 2 %.
TEST(NoiseUnevenness, IsLeastWhereNoiseIsEven)
{
    std::vector<ImageF> codes = ramp(0.1f, 0.9f, 0.008f);
    const auto inCodes = noiseUnevenness(codes);
    ASSERT_TRUE(inCodes);
    EXPECT_LT(*inCodes, 0.06);
    // The slope of the sRGB curve differs by 8 between these ends.
    for (ImageF& frame : codes) fromModel(frame, ModelSpace::Display);
    const auto inLight = noiseUnevenness(codes);
    ASSERT_TRUE(inLight);
    EXPECT_GT(*inLight, 0.3);
    for (ImageF& frame : codes) toModel(frame, ModelSpace::Display);
    EXPECT_NEAR(*noiseUnevenness(codes), *inCodes, 0.005);

    std::vector<ImageF> light = ramp(0.05f, 0.9f, 0.004f);
    EXPECT_LT(*noiseUnevenness(light), 0.06);
    for (ImageF& frame : light) toModel(frame, ModelSpace::Display);
    EXPECT_GT(*noiseUnevenness(light), 0.3);
}

TEST(NoiseUnevenness, IsOfLogarithmsAndKnowsNoUnit)
{
    std::vector<ImageF> frames = ramp(0.1f, 0.9f, 0.008f);
    for (ImageF& frame : frames) fromModel(frame, ModelSpace::Display);
    const double one = *noiseUnevenness(frames);
    for (ImageF& frame : frames)
        for (float& value : frame.values()) value *= 1000;
    EXPECT_NEAR(*noiseUnevenness(frames), one, 1e-3);
}

TEST(NoiseUnevenness, IsUnknownWhereThereIsNoNoise)
{
    EXPECT_FALSE(noiseUnevenness({}));
    EXPECT_FALSE(noiseUnevenness(ramp(0, 1, 0.01f, 1)));
    EXPECT_FALSE(noiseUnevenness(ramp(0, 1, 0.01f, 2)));
    EXPECT_FALSE(noiseUnevenness(ramp(0, 1, 0)));
    EXPECT_FALSE(noiseUnevenness(ramp(1, 1, 0)));
    const std::vector<ImageF> dots(20, ImageF(1, 1, 1, 0.5f));
    EXPECT_FALSE(noiseUnevenness(dots));
}

TEST(EnvironmentColor, GrowsWithThePlateAndIsBetweenItsEnds)
{
    ImageF plate(64, 36, 3), grey(64, 36, 1), same(64, 36, 3);
    for (int y = 0; y < 36; ++y)
        for (int x = 0; x < 64; ++x) {
            for (int j = 0; j < 3; ++j) plate.at(x, y, j) = (y < 14 ? 0.9f : 0.1f) * (1 + 0.2f * float(j - 1));
            grey.at(x, y) = y < 14 ? 0.9f : 0.1f;
            for (int j = 0; j < 3; ++j) same.at(x, y, j) = grey.at(x, y);
        }
    const auto one = environmentColor(plate, 1.0);
    for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_GT(one[j], 0.1 * (0.8 + 0.2 * double(j)));
        EXPECT_LT(one[j], 0.9 * (0.8 + 0.2 * double(j)));
    }
    EXPECT_LT(one[0], one[1]);
    EXPECT_LT(one[1], one[2]);
    // As long as nothing is so bright that it may be cut off.
    ImageF half = plate, quarter = plate;
    for (float& value : half.values()) value *= 0.5f;
    for (float& value : quarter.values()) value *= 0.25f;
    const auto ofHalf = environmentColor(half, 1.0), ofQuarter = environmentColor(quarter, 1.0);
    for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_NEAR(ofHalf[j], 2 * ofQuarter[j], 1e-4);
        EXPECT_GT(one[j], 1.9 * ofHalf[j]);
    }
    const auto ofGrey = environmentColor(grey, 1.0), ofSame = environmentColor(same, 1.0);
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(ofGrey[j], ofSame[j], 1e-6);
}

// A furnace: where everything is alike a drop returns that.
TEST(EnvironmentColor, OfAnEvenPlateIsThePlates)
{
    const auto even = environmentColor(ImageF(32, 18, 3, 0.4f), 0.8);
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(even[j], 0.4, 0.01);
    // Values below 0 are none.
    const auto black = environmentColor(ImageF(32, 18, 3, -0.4f), 0.8);
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(black[j], 0.0, 1e-9);
}

}  // namespace
}  // namespace virga::shot
