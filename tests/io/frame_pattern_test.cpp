#include <gtest/gtest.h>

#include <fstream>

#include "io/Helpers.h"
#include "io/Plate.h"
#include "io/PlateName.h"

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
    EXPECT_EQ(framePath("shot.%4d.exr", 57), "shot.  57.exr");
    EXPECT_EQ(framePath("shot.%4d.exr", -57), "shot. -57.exr");
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

TEST(FramePattern, WidthWithoutZeroIsFilledWithSpaces)
{
    const test::TemporaryFolder folder;
    for (const char* name : {"s.   1.exr", "s.0002.exr", "s.3.exr", "s.10000.exr"}) std::ofstream(folder / name) << "x";
    EXPECT_EQ(findFrames(folder / "s.%4d.exr"), (std::vector<FrameNumber>{1, 10000}));
}

TEST(PlateName, TheNumberOfOneFrame)
{
    EXPECT_EQ(frameNumberIn("a/shot.1003.exr"), 1003);
    EXPECT_EQ(frameNumberIn("b_0001.png"), 1);
    EXPECT_EQ(frameNumberIn("0007.jpg"), 7);
    EXPECT_EQ(frameNumberIn("s.-012.exr"), -12);
    EXPECT_EQ(frameNumberIn("s_-3.exr"), -3);
    EXPECT_EQ(frameNumberIn("take.2.0010.exr"), 10);
    // Numbers that belong to the name.
    for (const char* name : {"still.png", "IMG1234.jpg", "take-2.exr", "4k/plate.exr", "shot.0001.left.exr", "",
                             "99999999999999999999.png"})
        EXPECT_EQ(frameNumberIn(name), std::nullopt) << name;
    const test::TemporaryFolder folder;
    writeExr(folder / "shot.1003.exr", ImageF(4, 4, 4), {"R", "G", "B", "A"}, true);
    EXPECT_EQ(openPlate(folder / "shot.1003.exr", {})->info().frames, std::vector<FrameNumber>{1003});
    ReadOptions renumbered;
    renumbered.firstFrame = 5;
    EXPECT_EQ(openPlate(folder / "shot.1003.exr", renumbered)->info().frames, std::vector<FrameNumber>{5});
}

TEST(FramePattern, OfAFileIsTheNumberThatGivesItsName)
{
    EXPECT_EQ(frameNumberOf("in/s.%04d.exr", "s.0012.exr"), 12);
    EXPECT_EQ(frameNumberOf("s.####.exr", "s.-012.exr"), -12);
    EXPECT_EQ(frameNumberOf("s.%3d.exr", "s.  7.exr"), 7);
    EXPECT_EQ(frameNumberOf("s.$F.exr", "s.123456.exr"), 123456);
    for (const char* name :
         {"s.12.exr", "s.00012.exr", "s..exr", "s.exr", "s.    .exr", "t.0012.exr", "s.0012.png", ""})
        EXPECT_EQ(frameNumberOf("s.%04d.exr", name), std::nullopt) << name;
    for (const char* name : {"s.   .exr", "s.  x.exr", "s.7  .exr", "s.007.exr"})
        EXPECT_EQ(frameNumberOf("s.%3d.exr", name), std::nullopt) << name;
    EXPECT_EQ(frameNumberOf("s.exr", "s.exr"), std::nullopt);
}

TEST(PlateName, AFolderIsTheSequenceInIt)
{
    const auto folderWith = [](const std::vector<std::string>& names) {
        auto folder = std::make_unique<test::TemporaryFolder>();
        for (const std::string& name : names) std::ofstream(*folder / name) << "x";
        return folder;
    };
    const struct {
        std::vector<std::string> names;
        std::string pattern;
    } cases[] = {
        {{"s.0001.exr", "s.0002.exr", ".s.0003.exr.partial", "notes.txt", ".DS_Store"}, "s.%04d.exr"},
        {{"s.9.exr", "s.10.exr", "s.100.exr"}, "s.%01d.exr"},
        {{"s.0999.exr", "s.1000.exr", "s.10000.exr"}, "s.%04d.exr"},
        {{"s.-002.exr", "s.-001.exr", "s.0000.exr"}, "s.%04d.exr"},
        {{"0001.png", "0002.png"}, "%04d.png"},
        {{"take2_v003.0001.exr", "take2_v003.0002.exr"}, "take2_v003.%04d.exr"},
        {{"only.exr"}, "only.exr"},
        {{"shot.0005.exr"}, "shot.0005.exr"},
    };
    for (const auto& [names, pattern] : cases) {
        const auto folder = folderWith(names);
        EXPECT_EQ(resolvePlateName(*folder / ""), *folder / pattern);
        if (isFramePattern(pattern)) {
            std::size_t images = 0;
            for (const std::string& name : names) images += name[0] != '.' && name.find(".txt") == std::string::npos;
            EXPECT_EQ(findFrames(*folder / pattern).size(), images) << pattern;
        }
    }
    for (const auto& names :
         std::vector<std::vector<std::string>>{{"a.0001.exr", "a.0002.exr", "b.0001.exr", "b.0002.exr"},
                                               {"a.0001.exr", "a.0002.exr", "still.exr"},
                                               {"a.0001.exr", "a.0002.exr", "a.0001.png"},
                                               {"a.1.exr", "a.2.exr", "a.0001.exr", "a.0002.exr"}}) {
        const auto folder = folderWith(names);
        const std::string sentence = test::sentenceOf(ErrorCode::Input, [&] { openPlate(*folder / "", {}); });
        EXPECT_SAYS(sentence, "several");
        EXPECT_SAYS(sentence, "a.%0");
    }
    const test::TemporaryFolder empty;
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Input, [&] { openPlate(empty / "", {}); }), "folder without images");
    EXPECT_EQ(resolvePlateName("none/shot.%04d.exr"), "none/shot.%04d.exr");
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
