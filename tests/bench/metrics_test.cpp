// FLIP against limits that its paper states, and the other measures against their definitions.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/EffectStatistics.h"
#include "bench/Flip.h"
#include "bench/PictureError.h"

namespace virga::bench {
namespace {

constexpr int side = 48;

ImageF plain(float r, float g, float b)
{
    ImageF image(side, side, 3);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            image.at(x, y, 0) = r;
            image.at(x, y, 1) = g;
            image.at(x, y, 2) = b;
        }
    return image;
}

/// Something with edges, points and colours in it.
ImageF busy()
{
    ImageF image = plain(0.3f, 0.25f, 0.2f);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            for (int c = 0; c < 3; ++c)
                image.at(x, y, c) *= 1 + 0.5f * std::sin(0.7f * float(x * (c + 1)) + 0.2f * float(y));
    return image;
}

TEST(Flip, IsZeroForEqualPicturesAlone)
{
    EXPECT_EQ(meanFlip(busy(), busy()), 0);
    ImageF other = busy();
    other.at(20, 20, 1) += 0.05f;
    EXPECT_GT(meanFlip(busy(), other), 0);
}

// Section 4.1.3: the largest colour difference of a display is that of its green and its blue, and it becomes 1.
TEST(Flip, IsOneBetweenGreenAndBlue)
{
    EXPECT_NEAR(meanFlip(plain(0, 1, 0), plain(0, 0, 1)), 1, 1e-6);
    EXPECT_LT(meanFlip(plain(1, 0, 0), plain(0, 0, 1)), 1);
}

// HyAB of black and white is 100; green and blue are (87.7, -75.6, 73.0) and (32.3, 25.6, -34.8) with Hunt's effect,
// 203.4 apart: 0.95 + 0.05 (25.1 / 41.3 - 0.4) / 0.6.
TEST(Flip, BetweenBlackAndWhiteIsWhatThePapersNumbersGive)
{
    EXPECT_NEAR(meanFlip(plain(0, 0, 0), plain(1, 1, 1)), 0.9674, 1e-3);
}

TEST(Flip, StaysWithinItsRangeAndIsSymmetric)
{
    ImageF other = busy();
    for (int y = 10; y < 20; ++y)
        for (int x = 10; x < 40; ++x) other.at(x, y, 0) = 5;  // over white: cut off
    const ImageF there = flip(busy(), other), back = flip(other, busy());
    for (std::size_t i = 0; i < there.size(); ++i) {
        EXPECT_GE(there.data()[i], 0);
        EXPECT_LE(there.data()[i], 1);
        EXPECT_EQ(there.data()[i], back.data()[i]);
    }
    EXPECT_GT(there.at(25, 15), there.at(25, 40));
}

// The eye does not see the finest red-green pattern: filtered before it is compared, it differs less than its pixels
// do.
TEST(Flip, FinePatternsDifferLessThanCoarseOnes)
{
    const auto stripes = [](int wide) {
        ImageF image = plain(0.3f, 0.3f, 0.3f);
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) image.at(x, y, x / wide % 2 ? 0 : 1) += 0.2f;
        return image;
    };
    const ImageF grey = plain(0.4f, 0.4f, 0.3f);
    EXPECT_LT(meanFlip(stripes(1), grey), 0.5 * meanFlip(stripes(12), grey));
}

// Section 4.3: an edge or a point that only one picture has counts for more than its colour alone.
TEST(Flip, FeaturesAddToTheDifference)
{
    ImageF dot = plain(0.2f, 0.2f, 0.2f);
    for (int y = 23; y < 26; ++y)
        for (int x = 23; x < 26; ++x)
            for (int c = 0; c < 3; ++c) dot.at(x, y, c) = 0.6f;
    const ImageF map = flip(plain(0.2f, 0.2f, 0.2f), dot);
    // Far from it there is nothing; on it more than a whole picture brighter by what the eye's blur leaves.
    EXPECT_EQ(map.at(2, 2), 0);
    EXPECT_GT(map.at(24, 24), 0.2);
}

TEST(Flip, FartherAwayLessIsSeen)
{
    ImageF noise = busy();
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) noise.at(x, y, 1) += (x + y) % 2 ? 0.05f : -0.05f;
    EXPECT_LT(meanFlip(busy(), noise, 120), meanFlip(busy(), noise, 30));
}

TEST(PictureError, IsRelativeToThePlatesMean)
{
    const PictureError error = pictureError(plain(0.5f, 0.5f, 0.5f), plain(0.4f, 0.5f, 0.5f), 0.5);
    EXPECT_NEAR(error.rmse, 0.1 / std::sqrt(3.0) / 0.5, 1e-6);
    EXPECT_NEAR(error.most, 0.2, 1e-6);
    EXPECT_NEAR(meanOf(plain(0.1f, 0.2f, 0.3f)), 0.2, 1e-6);
}

TEST(PowerSpectrum, AddsUpToTheVarianceAndFindsAWave)
{
    ImageF image(60, 40, 1);
    double mean = 0, square = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 60; ++x) {
            image.at(x, y) =
                1 + 0.5f * std::sin(2 * 3.14159265f * 9 * float(x) / 60) + 0.1f * float((x * 7 + y * 3) % 5);
            mean += double(image.at(x, y)) / 2400;
        }
    for (const float value : image.values()) square += std::pow(double(value) - mean, 2) / 2400;
    const std::vector<double> rings = powerSpectrum(image, 0);
    double sum = 0;
    for (const double ring : rings) sum += ring;
    EXPECT_NEAR(sum, square, 1e-9);
    EXPECT_EQ(std::max_element(rings.begin(), rings.end()) - rings.begin(), 6);  // 9 cycles over 60 px: 6 over 40
    EXPECT_GT(rings[6], 0.12);
}

ImageF noise(int width, int height, float strength, std::uint32_t seed)
{
    ImageF image(width, height, 3);
    for (float& value : image.values()) {
        seed = seed * 1664525u + 1013904223u;
        value = strength * float(seed >> 8) / float(1u << 24);
    }
    return image;
}

// White noise has the same power at every frequency: a ring holds as much as it has frequencies.
TEST(PowerSpectrum, OfWhiteNoiseGrowsWithTheRings)
{
    const std::vector<double> rings = powerSpectrum(noise(64, 64, 1, 7), 0);
    double low = 0, high = 0;
    for (int k = 8; k < 12; ++k) low += rings[std::size_t(k)];
    for (int k = 16; k < 24; ++k) high += rings[std::size_t(k)];
    // Areas (24^2 - 16^2) and (12^2 - 8^2); 251 and 1005 independent frequencies, so 7 % is one standard deviation.
    EXPECT_NEAR(high / low, 320.0 / 80.0, 0.9);
}

// A shifted picture has the same spectrum.
TEST(PowerSpectrum, DoesNotMoveWithThePicture)
{
    const ImageF image = noise(40, 24, 1, 3);
    ImageF moved = image;
    for (int y = 0; y < 24; ++y)
        for (int x = 0; x < 40; ++x)
            for (int c = 0; c < 3; ++c) moved.at(x, y, c) = image.at((x + 11) % 40, (y + 5) % 24, c);
    const std::vector<double> a = powerSpectrum(image, 1), b = powerSpectrum(moved, 1);
    for (std::size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], 1e-12);
}

TEST(Moments, AreThoseOfTheDefinition)
{
    ImageF image(4, 1, 3);
    for (int x = 0; x < 4; ++x) image.at(x, 0, 1) = x == 3 ? 1.0f : 0.0f;  // Bernoulli with p = 1/4
    const Moments found = momentsOf(image, 1);
    EXPECT_NEAR(found.mean, 0.25, 1e-9);
    EXPECT_NEAR(found.variance, 0.1875, 1e-9);
    EXPECT_NEAR(found.skewness, 0.5 / std::sqrt(0.1875), 1e-9);  // (1 - 2 p) / sqrt(p (1 - p))
    EXPECT_EQ(momentsOf(ImageF(4, 1, 3, 0.5f), 1).skewness, 0);
}

// Half the light has half the mean, a quarter of the variance and of the power everywhere: -6.02 dB, and its shape.
TEST(EffectComparison, OfHalfTheEffect)
{
    const ImageF truth = noise(48, 32, 1, 5);
    ImageF half = truth;
    for (float& value : half.values()) value *= 0.5f;
    const EffectComparison found = compareEffects(half, truth);
    EXPECT_NEAR(found.mean, 0.5, 1e-6);
    EXPECT_NEAR(found.variance, 0.25, 1e-6);
    EXPECT_NEAR(found.coarse, 0.25, 1e-6);
    EXPECT_NEAR(found.fine, 0.25, 1e-6);
    EXPECT_NEAR(found.spectrum_dB, 20 * std::log10(2.0), 1e-5);
    EXPECT_NEAR(found.skewness, found.trueSkewness, 1e-6);
}

TEST(EffectComparison, OfNothingIsNothing)
{
    const EffectComparison found = compareEffects(ImageF(16, 16, 3), ImageF(16, 16, 3));
    EXPECT_EQ(found.mean, 1);
    EXPECT_EQ(found.variance, 1);
    EXPECT_EQ(found.spectrum_dB, 0);
}

// What is smoothed loses its fine power and keeps its mean.
TEST(EffectComparison, TellsFineFromCoarse)
{
    const ImageF truth = noise(48, 48, 1, 9);
    ImageF smooth = truth;
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 48; ++x) {
            float sum = 0;
            for (int j = 0; j < 3; ++j)
                for (int i = 0; i < 3; ++i) sum += truth.at((x + i) % 48, (y + j) % 48, 1);
            smooth.at(x, y, 1) = sum / 9;
        }
    const EffectComparison found = compareEffects(smooth, truth);
    EXPECT_NEAR(found.mean, 1, 1e-5);
    EXPECT_LT(found.fine, 0.2);
    EXPECT_GT(found.coarse, 0.6);
}

}  // namespace
}  // namespace virga::bench
