// What one thread keeps at hand.
#include <gtest/gtest.h>

#include <string>
#include <thread>

#include "core/KeptFiles.h"
#include "core/KeptInMemory.h"

namespace virga {
namespace {

TEST(KeptInMemory, GivesWhatWasStoredUnderKindAndKey)
{
    const KeptInMemory memory;
    const KeptFiles files;  // without a folder
    files.store("light", "a", "day");
    files.store("program", "a", "code");
    EXPECT_EQ(files.load("light", "a"), "day");
    EXPECT_EQ(files.load("program", "a"), "code");
    EXPECT_EQ(files.load("light", "b"), std::nullopt);
    files.store("light", "a", "night");
    EXPECT_EQ(files.load("light", "a"), "night");
}

TEST(KeptInMemory, IsOfItsThreadAndGoesWithItself)
{
    const KeptFiles files;
    {
        const KeptInMemory memory;
        files.store("light", "a", "day");
        std::thread([&] { EXPECT_EQ(files.load("light", "a"), std::nullopt); }).join();
    }
    EXPECT_EQ(KeptInMemory::ofThread(), nullptr);
    EXPECT_EQ(files.load("light", "a"), std::nullopt);
}

// The oldest by use go first, and what is too large alone is not kept at all.
TEST(KeptInMemory, HoldsNoMoreThanItsBytes)
{
    KeptInMemory memory(100);
    memory.store("k", "1", std::string(40, 'x'));
    memory.store("k", "2", std::string(40, 'y'));
    EXPECT_TRUE(memory.load("k", "1"));
    memory.store("k", "3", std::string(40, 'z'));
    EXPECT_TRUE(memory.load("k", "1"));
    EXPECT_FALSE(memory.load("k", "2"));
    EXPECT_TRUE(memory.load("k", "3"));
    EXPECT_LE(memory.bytes(), 100u);
    memory.store("k", "4", std::string(101, '!'));
    EXPECT_FALSE(memory.load("k", "4"));
    EXPECT_TRUE(memory.load("k", "3"));
}

}  // namespace
}  // namespace virga
