#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "core/KeptFiles.h"
#include "support/Files.h"

namespace virga {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

std::string fileIn(const std::string& folder)
{
    for (const auto& entry : fs::directory_iterator(folder)) return entry.path();
    return "";
}

TEST(KeptFiles, GivesBackWhatWasStoredUnderTheKeyAlone)
{
    const TemporaryFolder folder;
    const KeptFiles kept(folder / "deep/cache");
    std::string content(100'000, '\0');
    for (std::size_t i = 0; i < content.size(); ++i) content[i] = char(i * 7);
    EXPECT_FALSE(kept.load("program", "key"));
    kept.store("program", "key", content);
    EXPECT_EQ(kept.load("program", "key"), content);
    EXPECT_FALSE(kept.load("program", "kez"));
    EXPECT_FALSE(kept.load("light", "key"));
    kept.store("program", "key", "");
    EXPECT_EQ(kept.load("program", "key"), "");
    EXPECT_FALSE(KeptFiles().load("program", "key"));
}

TEST(KeptFiles, DamagedFilesAreNotThere)
{
    const TemporaryFolder folder;
    const KeptFiles kept(folder.path());
    const std::string content = "what was worked out, at length";
    kept.store("light", "key", content);
    const std::string path = fileIn(folder.path());
    std::ifstream in(path, std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const auto write = [&](const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; };
    for (std::size_t size = 0; size < whole.size(); ++size) {
        write(whole.substr(0, size));
        EXPECT_FALSE(kept.load("light", "key")) << size;
    }
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string wrong = whole;
        wrong[at] = char(wrong[at] ^ 0x20);
        write(wrong);
        EXPECT_FALSE(kept.load("light", "key")) << at;
    }
    write(whole + "x");
    EXPECT_FALSE(kept.load("light", "key"));
    write(whole);
    EXPECT_EQ(kept.load("light", "key"), content);
}

TEST(KeptFiles, WhatWasNotAskedForTheLongestGoesFirst)
{
    const TemporaryFolder folder;
    const KeptFiles kept(folder.path(), 10'000);
    const std::string content(2000, 'x');
    const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(15)); };
    for (const char* key : {"a", "b", "c", "d"}) kept.store("light", key, content), wait();
    EXPECT_TRUE(kept.load("light", "a"));
    wait();
    kept.store("light", "e", content);
    EXPECT_TRUE(kept.load("light", "a"));
    EXPECT_FALSE(kept.load("light", "b"));
    EXPECT_TRUE(kept.load("light", "e"));
    kept.store("light", "huge", std::string(9000, 'x'));
    EXPECT_FALSE(kept.load("light", "huge")) << "one must not push out all others";
    std::uintmax_t all = 0;
    for (const auto& entry : fs::directory_iterator(folder.path())) all += entry.file_size();
    EXPECT_LE(all, 10'000u);
}

TEST(KeptFiles, WhereNothingCanBeWrittenNothingIsKept)
{
    const TemporaryFolder folder;
    const KeptFiles kept(folder.write("file", "not a folder"));
    kept.store("light", "key", "content");
    EXPECT_FALSE(kept.load("light", "key"));
    EXPECT_TRUE(fs::is_regular_file(folder / "file"));
}

TEST(KeptFiles, ManyWritersLeaveOneWholeFile)
{
    const TemporaryFolder folder;
    const KeptFiles kept(folder.path());
    std::vector<std::thread> writers;
    for (char letter : {'a', 'b', 'c', 'd'})
        writers.emplace_back([&, letter] {
            for (int i = 0; i < 50; ++i) {
                kept.store("light", "key", std::string(5000, letter));
                const auto found = kept.load("light", "key");
                EXPECT_TRUE(!found || *found == std::string(5000, (*found)[0]));
            }
        });
    for (std::thread& writer : writers) writer.join();
    EXPECT_TRUE(kept.load("light", "key"));
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(KeptFiles, LieWhereTheUserKeepsSuchThings)
{
    const std::string cache = std::getenv("XDG_CACHE_HOME") ? std::getenv("XDG_CACHE_HOME") : "";
    setenv("XDG_CACHE_HOME", "/somewhere", 1);
    EXPECT_EQ(keptFilesFolder(), "/somewhere/virga");
    setenv("XDG_CACHE_HOME", "not/absolute", 1);
    EXPECT_NE(keptFilesFolder(), "not/absolute/virga");
    cache.empty() ? unsetenv("XDG_CACHE_HOME") : setenv("XDG_CACHE_HOME", cache.c_str(), 1);
}

TEST(ContentHash, DiffersWithEveryBit)
{
    const std::string text = "the light of a panorama, 17";
    for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
        std::string other = text;
        other[bit / 8] = char(other[bit / 8] ^ (1 << bit % 8));
        EXPECT_NE(contentHash(other), contentHash(text));
    }
    EXPECT_NE(contentHash(std::string(8, '\0')), contentHash(std::string(9, '\0')));
}

}  // namespace
}  // namespace virga
