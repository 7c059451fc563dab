#include "support/Scores.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

namespace virga {
namespace {

using namespace test;

/// Codes of 8 bits that look random and are the same everywhere.
ImageF grain(int width, int height, int channels, int seed)
{
    ImageF image(width, height, channels);
    std::uint32_t state = 12345u + std::uint32_t(seed);
    for (float& value : image.values()) value = float((state = state * 1664525u + 1013904223u) >> 24) / 255;
    return image;
}

ImageF plus(ImageF image, float offset)
{
    for (float& value : image.values()) value += offset;
    return image;
}

TEST(Scores, AnOffsetOfATenthIsTwentyDecibels)
{
    const std::vector<ImageF> grey{ImageF(13, 12, 3, 0.4f)};
    EXPECT_NEAR(peakSignalToNoise({plus(grey[0], 0.1f)}, grey), 20, 1e-5);
    EXPECT_NEAR(rootMeanSquare({plus(grey[0], 0.1f)}, grey), 0.1, 1e-7);
    EXPECT_EQ(peakSignalToNoise(grey, grey), std::numeric_limits<double>::infinity());
    // Frames count alike: 20 and 40 dB are 30, which the error over both is not.
    EXPECT_NEAR(peakSignalToNoise({plus(grey[0], 0.1f), plus(grey[0], 0.01f)}, {grey[0], grey[0]}), 30, 1e-4);
    // What is beyond white or black is no error.
    const std::vector<ImageF> white{ImageF(13, 12, 1, 1.0f)};
    EXPECT_EQ(peakSignalToNoise({plus(white[0], 0.5f)}, white), std::numeric_limits<double>::infinity());
}

TEST(Scores, SimilarityFollowsItsFormula)
{
    const ImageF image = grain(17, 14, 3, 0);
    EXPECT_NEAR(structuralSimilarity(image, image), 1, 1e-12);
    const ImageF other = grain(17, 14, 3, 1);
    EXPECT_DOUBLE_EQ(structuralSimilarity(image, other), structuralSimilarity(other, image));
    // Flat pictures have no structure: luminance alone.
    const double p = 0.25, q = 0.5;
    EXPECT_NEAR(structuralSimilarity(ImageF(11, 11, 1, 0.25f), ImageF(11, 11, 1, 0.5f)),
                (2 * p * q + 1e-4) / (p * p + q * q + 1e-4), 1e-9);
    // One whole window: the sums written out, without their separation into rows and columns.
    const ImageF a = grain(11, 11, 1, 2), b = grain(11, 11, 1, 3);
    double weight = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (int y = 0; y < 11; ++y)
        for (int x = 0; x < 11; ++x) {
            const double w = std::exp(-((x - 5) * (x - 5) + (y - 5) * (y - 5)) / 4.5), u = a.at(x, y), v = b.at(x, y);
            weight += w;
            ma += w * u;
            mb += w * v;
            aa += w * u * u;
            bb += w * v * v;
            ab += w * u * v;
        }
    ma /= weight;
    mb /= weight;
    const double va = aa / weight - ma * ma, vb = bb / weight - mb * mb, covariance = ab / weight - ma * mb;
    EXPECT_NEAR(structuralSimilarity(a, b),
                (2 * ma * mb + 1e-4) * (2 * covariance + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4)), 1e-9);
}

TEST(Scores, StreaksAreWhatIsMoreThanFiveLevelsAbove)
{
    const std::vector<ImageF> clean{ImageF(4, 1, 3, 100 / 255.0f)};
    std::vector<ImageF> rainy = clean;
    const int levels[] = {5, 6, 20, 0};  // the first is none: not more than 5
    for (int x = 0; x < 4; ++x)
        for (int c = 0; c < 3; ++c) rainy[0].at(x, 0, c) = float(100 + levels[x]) / 255;
    const Detection all = streakDetection(rainy, clean, clean);
    EXPECT_EQ(all.truth, 2);
    EXPECT_EQ(all.f(), 1);
    EXPECT_EQ(streakDetection(rainy, rainy, clean).f(), 0);
    std::vector<ImageF> derained = rainy;  // one of two found, and one that is none
    for (const int x : {2, 3})
        for (int c = 0; c < 3; ++c) derained[0].at(x, 0, c) -= 20 / 255.0f;
    const Detection half = streakDetection(rainy, derained, clean);
    EXPECT_EQ(half.precision(), 0.5);
    EXPECT_EQ(half.recall(), 0.5);
    EXPECT_EQ(half.f(), 0.5);
    EXPECT_EQ(streakDetection(clean, clean, clean).f(), 0);
}

}  // namespace
}  // namespace virga
