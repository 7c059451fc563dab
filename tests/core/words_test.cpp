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

}  // namespace
}  // namespace virga
