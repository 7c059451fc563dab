#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "core/KeptInMemory.h"
#include "shot/AtlasFile.h"

namespace virga::shot {
namespace {

bool areSame(const ImageF& a, const ImageF& b) { return std::ranges::equal(a.values(), b.values()); }

// What was kept is what would be made, with all that is derived from it.
TEST(BuiltInAtlas, IsTheSameFromMemory)
{
    const matte::StrokeAtlas made = builtInAtlas(5);
    const KeptInMemory memory;
    EXPECT_TRUE(areSame(builtInAtlas(5).layers, made.layers));
    EXPECT_GT(memory.bytes(), made.layers.size() * sizeof(float));
    const std::size_t bytes = memory.bytes();
    const matte::StrokeAtlas kept = builtInAtlas(5);
    EXPECT_EQ(memory.bytes(), bytes);
    EXPECT_TRUE(areSame(kept.layers, made.layers));
    EXPECT_EQ(kept.alongPrefix, made.alongPrefix);
    EXPECT_EQ(kept.summedArea, made.summedArea);
    ASSERT_EQ(kept.count(), made.count());
    EXPECT_EQ(std::memcmp(kept.mattes.data(), made.mattes.data(), made.mattes.size() * sizeof(matte::StrokeMatte)), 0);
    EXPECT_EQ(kept.groups, made.groups);
    EXPECT_EQ(kept.variants, made.variants);
    EXPECT_EQ(kept.firstBeadCycles, made.firstBeadCycles);
    EXPECT_FALSE(areSame(builtInAtlas(6).layers, made.layers));
}

}  // namespace
}  // namespace virga::shot
