#include <gtest/gtest.h>

#include "shot/MemoryPlan.h"

namespace virga::shot {
namespace {

io::PlateInfo plateOf(int width, int height)
{
    io::PlateInfo plate;
    plate.width = width;
    plate.height = height;
    return plate;
}

double planned(int width, int height, const MemoryDemand& demand, const Wanted& wanted = {})
{
    Settings settings;
    settings.ground = "1.6";
    return totalBytes(planMemory(planFrame(settings, wanted, false), plateOf(width, height), demand));
}

TEST(MemoryPlan, TheLengthOfAClipDoesNotMatter)
{
    for (const bool isSequence : {false, true})
        for (const auto& [width, height] : {std::pair{160, 90}, {1920, 1080}, {7680, 4320}})
            EXPECT_EQ(planned(width, height, {.frames = 100, .writesSequence = isSequence}),
                      planned(width, height, {.frames = 1'000'000, .writesSequence = isSequence}));
}

// The target: 8K with a million strokes under 4 GiB, by whatever device.
TEST(MemoryPlan, EightKStaysUnderFourGibibytes)
{
    for (const bool byShaders : {false, true})
        EXPECT_LT(planned(7680, 4320,
                          {.frames = 1000,
                           .strokes = 1e6,
                           .isDepthAnImage = true,
                           .writesSequence = true,
                           .writesHalf = true,
                           .byShaders = byShaders}),
                  4.0 * (1ull << 30) + (byShaders ? 2.0 * (1ull << 30) : 0.0));  // the device's own
    // Frames with layers are larger than all that may wait for a writer: there is one at a time.
    EXPECT_LT(planned(7680, 4320, {.frames = 1000, .strokes = 1e6, .writesSequence = true, .writesHalf = true},
                      {.layers = true}),
              4.0 * (1ull << 30));
}

TEST(MemoryPlan, WhatIsWantedIsHeld)
{
    const MemoryDemand demand = {.frames = 10, .strokes = 1e5};
    EXPECT_GT(planned(1920, 1080, demand, {.layers = true}), planned(1920, 1080, demand) + 4 * 16 * 1920 * 1080);
    EXPECT_GT(planned(3840, 2160, demand), planned(1920, 1080, demand));
    EXPECT_GT(planned(640, 480, {.frames = 10, .strokes = 1e7}), planned(640, 480, demand) + 5e8);
    EXPECT_NE(
        memoryWords(planMemory(planFrame({}, {}, false), plateOf(1920, 1080), demand)).find("8 frames ahead 265 MB"),
        std::string::npos);
}

}  // namespace
}  // namespace virga::shot
