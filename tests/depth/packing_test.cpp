#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "depth/DepthPacking.h"

namespace virga::depth {
namespace {

using Rgb = std::array<double, 3>;

double clipped(double v) { return std::clamp(v, 0.0, 255.0); }

/// As the paper colours: each channel a trapezium over the circle of hues, red's around its beginning and end. The
/// circle closes one step early: 1529, all red, looks like 0.
Rgb colored(int value)
{
    const double v = value;
    const auto trapezium = [&](double middle) { return clipped(510 - std::abs(v - middle)); };
    return {clipped(std::max(510 - v, v - 1020)), trapezium(510), v > 1275 ? 1529 - v : trapezium(1020)};
}

TEST(DepthPacking, WordsOfSixteenAndTwentyFourBits)
{
    std::mt19937 random(3);
    for (int i = 0; i < 1000; ++i) {
        const unsigned value = i == 0 ? 0 : i == 1 ? 0xFFFFFF : random() & 0xFFFFFF;
        const double low = value & 255, middle = value >> 8 & 255, high = value >> 16;
        EXPECT_EQ(unpackedDepth(DepthPacking::Rgb, {high, middle, low}), value);
        EXPECT_EQ(unpackedDepth(DepthPacking::Bgr, {low, middle, high}), value);
        EXPECT_EQ(unpackedDepth(DepthPacking::Rg, {middle, low, 99}), value & 0xFFFF);
        EXPECT_EQ(unpackedDepth(DepthPacking::Gr, {low, middle, 99}), value & 0xFFFF);
        EXPECT_EQ(double(float(unpackedDepth(DepthPacking::Rgb, {high, middle, low}))), value);  // floats hold it
    }
    for (const DepthPacking packing : {DepthPacking::Rg, DepthPacking::Gr, DepthPacking::Rgb, DepthPacking::Bgr})
        EXPECT_EQ(unpackedDepth(packing, {255, 255, 255}), largestPacked(packing));
}

TEST(DepthPacking, HuesComeBack)
{
    for (int value = 0; value < 1529; ++value) EXPECT_EQ(unpackedDepth(DepthPacking::Hue, colored(value)), value);
    EXPECT_EQ(largestPacked(DepthPacking::Hue), 1529);
}

TEST(DepthPacking, HuesSurviveWhatACodecDoes)
{
    // Haze in all three channels cancels; what a channel alone is off by is the value's own error.
    for (int value = 5; value < 1520; value += 7) {
        const Rgb c = colored(value);
        EXPECT_NEAR(unpackedDepth(DepthPacking::Hue, {c[0] + 3, c[1] + 3, c[2] + 3}), value, 1e-9);
        EXPECT_NEAR(unpackedDepth(DepthPacking::Hue, {c[0] + 1, c[1] - 1, c[2] + 2}), value, 6);
    }
}

TEST(DepthPacking, DarkPixelsHaveNoDepth)
{
    EXPECT_TRUE(std::isnan(unpackedDepth(DepthPacking::Hue, {0, 0, 0})));
    EXPECT_TRUE(std::isnan(unpackedDepth(DepthPacking::Hue, {80, 80, 90})));
    EXPECT_FALSE(std::isnan(unpackedDepth(DepthPacking::Hue, {255, 0, 0})));
}

}  // namespace
}  // namespace virga::depth
