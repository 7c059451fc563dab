#include <gtest/gtest.h>

#include <fstream>

#include "io/Helpers.h"
#include "io/Plate.h"

namespace virga::io {
namespace {

TEST(FramePattern, NamesFilesAsCompositorsWriteThem)
{
    EXPECT_EQ(framePath("a/shot.%04d.exr", 57), "a/shot.0057.exr");
    EXPECT_EQ(framePath("a/shot.####.exr", 57), "a/shot.0057.exr");
    EXPECT_EQ(framePath("shot.@.exr", 57), "shot.57.exr");
    EXPECT_EQ(framePath("shot.@@@.exr", 57), "shot.057.exr");
    EXPECT_EQ(framePath("shot.$F4.exr", 57), "shot.0057.exr");
    EXPECT_EQ(framePath("shot.$F.exr", 57), "shot.57.exr");
    EXPECT_EQ(framePath("shot.%d.exr", 12345678), "shot.12345678.exr");
    EXPECT_EQ(framePath("shot.%04d.exr", 123456), "shot.123456.exr");
    EXPECT_EQ(framePath("shot.%04d.exr", -5), "shot.-005.exr");
    EXPECT_EQ(framePath("take#2/shot.%02d.exr", 3), "take#2/shot.03.exr");
    EXPECT_EQ(framePath("take#2.%02d.exr", 3), "take#2.03.exr");
    EXPECT_EQ(framePath("still.exr", 3), "still.exr");
    EXPECT_EQ(framePath("100%.exr", 3), "100%.exr");
    EXPECT_TRUE(isFramePattern("shot.####.exr"));
    EXPECT_FALSE(isFramePattern("still.0001.exr"));
}

TEST(FramePattern, FindsTheFramesThatExist)
{
    const test::TemporaryFolder folder;
    for (const char* name : {"s.0001.exr", "s.0003.exr", "s.-002.exr", "s.10000.exr", "s.7.exr", "s.00008.exr",
                             "s.x.exr", "s.0004.png", "other.0005.exr", "s.0006.exr.tmp"})
        std::ofstream(folder / name) << "x";
    const std::vector<FrameNumber> expected = {-2, 1, 3, 10000};
    EXPECT_EQ(findFrames(folder / "s.%04d.exr"), expected);
    EXPECT_EQ(findFrames(folder / "s.####.exr"), expected);
    EXPECT_EQ(findFrames(folder / "s.%d.exr"), (std::vector<FrameNumber>{7, 10000}));
    EXPECT_TRUE(findFrames(folder / "nothing.%04d.exr").empty());
    for (const FrameNumber n : expected) EXPECT_TRUE(std::filesystem::exists(framePath(folder / "s.%04d.exr", n)));

    const std::string sentence = test::sentenceOf(ErrorCode::Input, [&] { findFrames(folder / "missing/s.%04d.exr"); });
    EXPECT_SAYS(sentence, folder / "missing");
}

TEST(FramePattern, TwoPlacesForTheNumberAreRefused)
{
    const test::TemporaryFolder folder;
    for (const char* name : {"q.%04d.%04d.exr", "q.####.%d.exr", "q.$F4.@@.exr", "q.%04d.#.exr"}) {
        const std::string input = test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / name, {}); });
        EXPECT_SAYS(input, folder / name);
        EXPECT_SAYS(input, "two places for the frame's number");
    }
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "q.####.%d.exr", {}); }), "#### and %d");
    writeExr(folder / "one.exr", ImageF(4, 4, 4), {"R", "G", "B", "A"}, true);
    const auto reader = openPlate(folder / "one.exr", {});
    EXPECT_SAYS(
        test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter(folder / "q.%04d.%04d.exr", *reader, {}); }),
        "two places for the frame's number");
    for (const char* name : {"take#2.%04d.exr", "me@home.####.exr", "####/q.%04d.exr"})
        EXPECT_NO_THROW(refuseTwoPatterns(folder / name, ErrorCode::Input)) << name;
    std::ofstream(folder / "a.%04d.%04d.exr") << "x";  // a file of that name is that file
    EXPECT_NO_THROW(refuseTwoPatterns(folder / "a.%04d.%04d.exr", ErrorCode::Input));
}

// A file whose name happens to look like a pattern is that file.
TEST(FramePattern, AFileThatExistsIsNoPattern)
{
    const test::TemporaryFolder folder;
    std::ofstream(folder / "take#2.exr") << "x";
    EXPECT_FALSE(isFramePattern(folder / "take#2.exr"));
    EXPECT_TRUE(isFramePattern(folder / "take#3.exr"));
}

}  // namespace
}  // namespace virga::io
