#include "core/Words.h"

#include <gtest/gtest.h>

#include <vector>

namespace virga {
namespace {

TEST(Words, Nearest)
{
    const std::vector<std::string> known = {"rain", "extract", "glass", "bench"};
    EXPECT_EQ(nearestWord("rian", known), "rain");
    EXPECT_EQ(nearestWord("extrct", known), "extract");
    EXPECT_EQ(nearestWord("glass", known), "glass");
    EXPECT_EQ(nearestWord("quaternion", known), "");
    EXPECT_EQ(nearestWord("", std::vector<std::string>{}), "");
}

TEST(Words, EditDistance)
{
    EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
    EXPECT_EQ(editDistance("", "rain"), 4u);
    EXPECT_EQ(editDistance("rain", "rain"), 0u);
}

TEST(Words, AreShownOnOneLine)
{
    EXPECT_EQ(onOneLine("wet\nstreet\x1b[2J\x7f \xc3\xa9"), "wet?street?[2J? \xc3\xa9");
    EXPECT_EQ(shortened("street", 6), "street");
    EXPECT_EQ(shortened("streets", 6), "street...");
}

TEST(Words, NestingIsCountedOutsideOfTexts)
{
    const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
    EXPECT_FALSE(isNestedDeeper(nested(5) + nested(5), 5));
    EXPECT_TRUE(isNestedDeeper(nested(6), 5));
    EXPECT_TRUE(isNestedDeeper("{\"a\": [{}]}", 2));
    EXPECT_FALSE(isNestedDeeper("[\"[[[\\\"[[[\"]", 1));
    EXPECT_FALSE(isNestedDeeper("]]]}}}[", 1));
    EXPECT_FALSE(isNestedDeeper("\"\\", 0));
}

}  // namespace
}  // namespace virga
