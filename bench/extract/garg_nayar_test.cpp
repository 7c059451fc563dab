#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "extract/GargNayar.h"

namespace virga::bench {
namespace {

constexpr int size = 48, count = 12;

/// A ramp down the picture, in which streaks meet different backgrounds.
std::vector<ImageF> still()
{
    ImageF scene(size, size, 1);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) scene.at(x, y) = float(0.2 + 0.4 * y / size);
    return std::vector<ImageF>(count, scene);
}

/// Three upright streaks a frame, two pixels wide, nowhere twice within three frames: dI = level + slope * background.
std::vector<ImageF> streaky(double level, double slope)
{
    std::vector<ImageF> frames = still();
    for (int n = 0; n < count; ++n)
        for (int i = 0; i < 3; ++i) {
            const int left = (5 + 11 * n + 16 * i) % (size - 2), top = (7 * n + 13 * i) % (size - 16);
            for (int y = top; y < top + 16; ++y)
                for (int x = left; x < left + 2; ++x) {
                    float& value = frames[std::size_t(n)].at(x, y);
                    value += float(level + slope * value);
                }
        }
    return frames;
}

double largestError(const std::vector<ImageF>& frames, const std::vector<ImageF>& truth)
{
    double largest = 0;
    for (std::size_t n = 0; n < frames.size(); ++n)
        for (std::size_t i = 0; i < frames[n].size(); ++i)
            largest = std::max(largest, std::abs(double(frames[n].data()[i]) - truth[n].data()[i]));
    return largest;
}

TEST(GargNayar, LeavesWhatStaysAndWhatIsDarker)
{
    EXPECT_EQ(largestError(gargNayar(still()), still()), 0);
    const std::vector<ImageF> dark = streaky(-0.1, 0);
    EXPECT_EQ(largestError(gargNayar(dark), dark), 0);
}

TEST(GargNayar, TakesOutRainOnAStillScene)
{
    EXPECT_LT(largestError(gargNayar(streaky(0.1, 0)), still()), 1e-6);
    EXPECT_LT(largestError(gargNayar(streaky(0.1, -0.03)), still()), 1e-6);
    // Below the least change, and in the frames beside a thing that stays for two.
    const std::vector<ImageF> faint = streaky(2.5 / 255, 0);
    EXPECT_EQ(largestError(gargNayar(faint), faint), 0);
    std::vector<ImageF> slow = still();
    for (const int n : {5, 6})
        for (int y = 10; y < 30; ++y) slow[std::size_t(n)].at(20, y) += 0.2f;
    EXPECT_EQ(largestError(gargNayar(slow), slow), 0);
}

TEST(GargNayar, RejectsWhatGrowsWithTheBackground)
{
    for (const double slope : {0.2, -0.2}) {
        const std::vector<ImageF> glints = streaky(0.15, slope);
        EXPECT_EQ(largestError(gargNayar(glints), glints), 0) << slope;
        EXPECT_LT(largestError(gargNayar(glints, {.photometric = false}), still()), 1e-6) << slope;
    }
}

TEST(GargNayar, RejectsFlickerWithoutADirection)
{
    std::vector<ImageF> flicker = still();
    std::uint32_t state = 1;
    for (ImageF& frame : flicker)
        for (int i = 0; i < 40; ++i) {
            state = state * 1664525u + 1013904223u;
            frame.at(int(state >> 8) % size, int(state >> 20) % size) += 0.2f;
        }
    const std::vector<ImageF> kept = gargNayar(flicker), removed = gargNayar(flicker, {.directional = 0});
    double left = 0, all = 0, leftWithout = 0;
    for (std::size_t n = 0; n < count; ++n)
        for (std::size_t i = 0; i < flicker[n].size(); ++i) {
            all += flicker[n].data()[i] - still()[n].data()[i];
            left += kept[n].data()[i] - still()[n].data()[i];
            leftWithout += removed[n].data()[i] - still()[n].data()[i];
        }
    EXPECT_LT(leftWithout, 0.1 * all);
    EXPECT_GT(left, 0.5 * all);
}

}  // namespace
}  // namespace virga::bench
