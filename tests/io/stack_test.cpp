// Frames that stand top to bottom in one image: ReadOptions::stack.

#include <gtest/gtest.h>

#include "io/Helpers.h"
#include "io/Plate.h"

namespace virga::io {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

/// Rows first..first + count.
ImageF rowsOf(const ImageF& image, int first, int count)
{
    ImageF part(image.width(), count, image.channels());
    std::copy_n(image.row(first), part.size(), part.data());
    return part;
}

ReadOptions stackOf(int frames)
{
    ReadOptions options;
    options.stack = frames;
    return options;
}

TEST(Stack, FramesAreItsRowsTopToBottom)
{
    const TemporaryFolder folder;
    const ImageF image = test::noise(24, 60, 3, -0.5f, 4.0f);
    writeExr(folder / "a.exr", image, {"R", "G", "B"}, false);
    writePng(folder / "a.png", test::noise(24, 60, 3, 0, 1));
    for (const char* name : {"a.exr", "a.png"}) {
        const ImageF whole = openPlate(folder / name, {})->read(0)->pixels;
        for (const int count : {1, 2, 5, 60}) {
            const auto plate = openPlate(folder / name, stackOf(count));
            const PlateInfo& info = plate->info();
            EXPECT_EQ(info.width, 24);
            EXPECT_EQ(info.height, 60 / count);
            EXPECT_FALSE(info.isStill);
            EXPECT_FALSE(info.isMovie);
            ASSERT_EQ(info.frames.size(), std::size_t(count));
            plate->schedule(info.frames);
            for (int k = 0; k < count; ++k) {
                EXPECT_EQ(info.frames[std::size_t(k)], k);
                const auto frame = plate->read(k);
                ASSERT_TRUE(frame);
                EXPECT_EQ(frame->number, k);
                EXPECT_NEAR(frame->time_s, k / info.fps, 1e-12);
                ASSERT_TRUE(test::sameBits(frame->pixels, rowsOf(whole, k * info.height, info.height)))
                    << name << ' ' << k << " of " << count;
            }
        }
    }
}

TEST(Stack, FramesAreNumberedAndTimedAsAsked)
{
    const TemporaryFolder folder;
    writeExr(folder / "a.exr", test::noise(8, 12, 3, 0, 1), {"R", "G", "B"}, false);
    const ImageF whole = openPlate(folder / "a.exr", {})->read(0)->pixels;
    ReadOptions options = stackOf(4);
    options.firstFrame = 1001;
    options.fps = 30;
    const auto plate = openPlate(folder / "a.exr", options);
    EXPECT_EQ(plate->info().frames, (std::vector<FrameNumber>{1001, 1002, 1003, 1004}));
    EXPECT_EQ(plate->info().fps, 30);
    // In any order.
    for (const int k : {2, 0, 3}) {
        const auto frame = plate->read(1001 + k);
        ASSERT_TRUE(frame);
        EXPECT_EQ(frame->number, 1001 + k);
        EXPECT_TRUE(test::sameBits(frame->pixels, rowsOf(whole, 3 * k, 3)));
    }
    options.firstFrame = -2;
    const auto before = openPlate(folder / "a.exr", options);
    EXPECT_EQ(before->info().frames, (std::vector<FrameNumber>{-2, -1, 0, 1}));
    EXPECT_TRUE(test::sameBits(before->read(-1)->pixels, rowsOf(whole, 3, 3)));
}

TEST(Stack, WhatIsNoneIsOneSentence)
{
    const TemporaryFolder folder;
    writeExr(folder / "a.exr", test::noise(8, 12, 3, 0, 1), {"R", "G", "B"}, false);
    for (const int count : {5, 7, 13, 24}) {
        const std::string sentence = sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.exr", stackOf(count)); });
        EXPECT_SAYS(sentence, folder / "a.exr");
        EXPECT_SAYS(sentence, "12 rows");
        EXPECT_SAYS(sentence, fmt::format("{} frames", count));
        EXPECT_EQ(sentence.find('\n'), std::string::npos);
    }
    const auto plate = openPlate(folder / "a.exr", stackOf(4));
    for (const FrameNumber number : {-1, 4, 1000}) {
        const std::string sentence = sentenceOf(ErrorCode::Input, [&] { plate->read(number); });
        EXPECT_SAYS(sentence, folder / "a.exr");
        EXPECT_SAYS(sentence, fmt::format("{}", number));
    }
    writeExr(folder / "b.0001.exr", test::noise(8, 12, 3, 0, 1), {"R", "G", "B"}, false);
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "b.####.exr", stackOf(4)); }), "not a pattern");
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "none.exr", stackOf(4)); }), "does not exist");
}

// A movie is no stack, and is said to be none.
TEST(Stack, AMovieIsNone)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "a.mkv", "-c:v ffv1", 2);
    const std::string sentence = sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.mkv", stackOf(4)); });
    EXPECT_SAYS(sentence, folder / "a.mkv");
    EXPECT_EQ(sentence.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace virga::io
