#include <gtest/gtest.h>

#include <limits>

#include "core/Error.h"
#include "core/FrameRange.h"

namespace virga {
namespace {

using Frames = std::vector<FrameNumber>;

TEST(FrameRange, ReadsWhatCompositorsWrite)
{
    EXPECT_EQ(parseFrameRange("7"), Frames({7}));
    EXPECT_EQ(parseFrameRange("1-4"), Frames({1, 2, 3, 4}));
    EXPECT_EQ(parseFrameRange("1-10x3"), Frames({1, 4, 7, 10}));
    EXPECT_EQ(parseFrameRange("-8--5"), Frames({-8, -7, -6, -5}));
    EXPECT_EQ(parseFrameRange("4-1"), Frames({4, 3, 2, 1}));
    EXPECT_EQ(parseFrameRange("9-1x-4"), Frames({9, 5, 1}));
    EXPECT_EQ(parseFrameRange("1-3, 8 2-4"), Frames({1, 2, 3, 8, 4}));
    EXPECT_EQ(parseFrameRange("10000000-10000001"), Frames({10000000, 10000001}));
}

TEST(FrameRange, SaysWhichPartItCannotRead)
{
    for (const char* text : {"", ",", "a", "1-", "1--", "1-5x", "1-5x0", "1-5x-1", "1-5y2", "1.5"}) {
        try {
            parseFrameRange(text);
            ADD_FAILURE() << "'" << text << "' was accepted";
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
            EXPECT_NE(std::string(error.what()).find(text), std::string::npos);
        }
    }
    EXPECT_THROW(parseFrameRange("0-1000", 100), Error);
}

TEST(FrameRange, NumbersAtTheEndsOfWhatTheyCanBe)
{
    constexpr FrameNumber most = std::numeric_limits<FrameNumber>::max(),
                          least = std::numeric_limits<FrameNumber>::min();
    EXPECT_EQ(parseFrameRange("9223372036854775806-9223372036854775807"), Frames({most - 1, most}));
    EXPECT_EQ(parseFrameRange("-9223372036854775807--9223372036854775808"), Frames({least + 1, least}));
    EXPECT_EQ(parseFrameRange("9223372036854775800-9223372036854775807x5"), Frames({most - 7, most - 2}));
    EXPECT_EQ(parseFrameRange("7-7x9223372036854775807"), Frames({7}));
    EXPECT_EQ(parseFrameRange("7-7x-9223372036854775808"), Frames({7}));
    EXPECT_EQ(parseFrameRange("-9223372036854775808-9223372036854775807x9223372036854775807"),
              Frames({least, -1, most - 1}));
    EXPECT_THROW(parseFrameRange("-9223372036854775808-9223372036854775807"), Error);  // and at once
    EXPECT_THROW(parseFrameRange("0-9223372036854775807"), Error);
    EXPECT_THROW(parseFrameRange("9223372036854775808"), Error);
    for (const Frames& frames : {Frames{least, most}, Frames{most, least}, Frames{least, -1, most - 1}})
        EXPECT_EQ(parseFrameRange(formatFrameRange(frames)), frames);
}

TEST(FrameRange, FormatAndParseAreInverse)
{
    for (const Frames& frames : {Frames{1, 2, 3, 5, 7, 9}, Frames{1}, Frames{-5, -4, 9}, Frames{1, 5}, Frames{4, 3, 2}})
        EXPECT_EQ(parseFrameRange(formatFrameRange(frames)), frames);
    EXPECT_EQ(formatFrameRange({1, 2, 3, 5, 7, 9}), "1-3,5-9x2");
}

}  // namespace
}  // namespace virga
