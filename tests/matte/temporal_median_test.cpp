#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "matte/TemporalMedian.h"

namespace virga {
namespace {

// Beside sorting, for every number of frames that the network may meet; sizes that do not fill its tiles.
TEST(TemporalMedian, IsTheMiddleOfTheSorted)
{
    std::mt19937 engine(7);
    for (int count = 1; count <= 70; ++count) {
        std::vector<ImageF> frames(std::size_t(count), ImageF(23, 3, 3));
        for (ImageF& frame : frames)
            for (float& value : frame.values()) value = float(engine() % 50) - 10.0f;  // with ties
        const ImageF median = matte::temporalMedian(frames);
        for (std::size_t i = 0; i < median.size(); ++i) {
            std::vector<float> sorted;
            for (const ImageF& frame : frames) sorted.push_back(frame.data()[i]);
            std::sort(sorted.begin(), sorted.end());
            const float expected = 0.5f * (sorted[(sorted.size() - 1) / 2] + sorted[sorted.size() / 2]);
            ASSERT_EQ(median.data()[i], expected) << count << " frames";
        }
    }
}

/// Sorted values over the frames of one place.
std::vector<float> sortedAt(const std::vector<ImageF>& frames, std::size_t i)
{
    std::vector<float> sorted;
    for (const ImageF& frame : frames) sorted.push_back(frame.data()[i]);
    std::sort(sorted.begin(), sorted.end());
    return sorted;
}

std::vector<ImageF> randomFrames(int count, std::mt19937& engine)
{
    std::vector<ImageF> frames(std::size_t(count), ImageF(23, 3, 3));
    for (ImageF& frame : frames)
        for (float& value : frame.values()) value = float(engine() % 5000) / 50.0f - 10.0f;
    return frames;
}

// Beside the definition. Where two halves are equally short either is the shorter one.
TEST(ShorterHalf, IsTheMeanOfTheClosest)
{
    std::mt19937 engine(8);
    for (const int count : {1, 2, 3, 4, 5, 6, 7, 10, 15, 16, 20, 31, 64, 70}) {
        const std::vector<ImageF> frames = randomFrames(count, engine);
        const ImageF shorter = matte::shorterHalfMean(frames);
        const std::size_t half = std::size_t(count) / 2 + 1;
        for (std::size_t i = 0; i < shorter.size(); ++i) {
            const std::vector<float> sorted = sortedAt(frames, i);
            if (std::size_t(count) < half) {
                ASSERT_EQ(shorter.data()[i], sorted[0]);
                continue;
            }
            float shortest = sorted.back() - sorted.front(), off = 1e9f;
            for (std::size_t k = 0; k + half <= sorted.size(); ++k)
                shortest = std::min(shortest, sorted[k + half - 1] - sorted[k]);
            for (std::size_t k = 0; k + half <= sorted.size(); ++k) {
                if (sorted[k + half - 1] - sorted[k] > shortest + 1e-4f) continue;
                double sum = 0;
                for (std::size_t n = k; n < k + half; ++n) sum += double(sorted[n]) / double(half);
                off = std::min(off, float(std::abs(sum - double(shorter.data()[i]))));
            }
            ASSERT_LT(off, 2e-4f) << count << " frames";
        }
    }
}

TEST(LowerQuarter, IsTheMeanOfTheDarkWithoutTheDarkest)
{
    std::mt19937 engine(9);
    for (const int count : {1, 2, 3, 4, 7, 8, 11, 12, 16, 20, 33}) {
        const std::vector<ImageF> frames = randomFrames(count, engine);
        const ImageF lower = matte::lowerQuarterMean(frames);
        for (std::size_t i = 0; i < lower.size(); ++i) {
            const std::vector<float> sorted = sortedAt(frames, i);
            double mean = sorted[0];
            if (count >= 8) {
                mean = 0;
                for (std::size_t n = 1; n < sorted.size() / 4; ++n) mean += double(sorted[n]);
                mean /= double(sorted.size() / 4 - 1);
            }
            ASSERT_NEAR(lower.data()[i], mean, 1e-4) << count << " frames";
        }
    }
}

// Nine of twenty values are wet: the median is at the upper end of what is dry, the shorter half all of it.
TEST(ShorterHalf, IsDryWhereTheMedianIsNot)
{
    std::mt19937 engine(10);
    std::vector<ImageF> frames(20, ImageF(50, 4, 1));
    for (std::size_t i = 0; i < 200; ++i)
        for (std::size_t k = 0; k < 20; ++k) {
            const float noise = 0.01f * (float(engine() % 1000) / 500.0f - 1.0f);
            const float wet = 0.1f + 0.3f * float(engine() % 1000) / 1000.0f;
            frames[(k + i) % 20].data()[i] = 0.3f + noise + (k < 9 ? wet : 0.0f);
        }
    const ImageF shorter = matte::shorterHalfMean(frames), median = matte::temporalMedian(frames);
    double off = 0, offOfMedian = 0;
    for (std::size_t i = 0; i < 200; ++i) {
        EXPECT_NEAR(shorter.data()[i], 0.3f, 0.01f);
        off += shorter.data()[i] - 0.3;
        offOfMedian += median.data()[i] - 0.3;
    }
    EXPECT_LT(std::abs(off), 0.5 * offOfMedian);
}

}  // namespace
}  // namespace virga
