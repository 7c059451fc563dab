// The server's parts by themselves: raw frames, reduced plates, the cache, shared memory, the served folder.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "core/Error.h"
#include "server/LruCache.h"
#include "server/Metrics.h"
#include "server/RawFrame.h"
#include "server/Refusal.h"
#include "server/ServedFolder.h"
#include "server/SharedMemory.h"
#include "support/Files.h"

namespace virga::server {
namespace {

namespace fs = std::filesystem;

ImageF grain(int width, int height)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> values(0, 2);
    ImageF image(width, height, 4);
    for (float& value : image.values()) value = values(random);
    return image;
}

TEST(RawFrame, FloatsComeBackBitForBitInTheirPlace)
{
    const ImageF pixels = grain(5, 3);
    const RawHeader header{{2, -1, 5, 3}, 9, 4, 77, true, {"R", "G", "B", "A"}};
    const RawPlane planes[] = {{pixels, 0}, {pixels, 1}, {pixels, 2}, {pixels, 3}};
    std::string bytes(header.bytes(), 'x');
    writeRaw(header, planes, reinterpret_cast<std::byte*>(bytes.data()));
    const RawHeader read = parseRawHeader(bytes);
    EXPECT_EQ(read.data, header.data);
    EXPECT_EQ(read.frame, 77);
    EXPECT_EQ(read.planes, header.planes);
    const ImageF whole = readRaw(bytes);
    ASSERT_EQ(whole.width(), 9);
    ASSERT_EQ(whole.height(), 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 9; ++x)
            for (int c = 0; c < 4; ++c) {
                const bool isInside = x >= 2 && x < 7 && y < 2;
                EXPECT_EQ(whole.at(x, y, c), isInside ? pixels.at(x - 2, y + 1, c) : 0.0f) << x << ' ' << y;
            }
    EXPECT_EQ(header.headerBytes() % 64, 0u);
    EXPECT_EQ(header.planeBytes() % 64, 0u);
}

TEST(RawFrame, EveryCutAndEveryContradictionIsRefused)
{
    const ImageF pixels = grain(4, 4);
    const RawHeader header{{0, 0, 4, 4}, 4, 4, 0, false, {"R", "G", "B"}};
    const RawPlane planes[] = {{pixels, 0}, {pixels, 1}, {pixels, 2}};
    std::string bytes(header.bytes(), '\0');
    writeRaw(header, planes, reinterpret_cast<std::byte*>(bytes.data()));
    EXPECT_NO_THROW(readRaw(bytes));
    EXPECT_EQ(readRaw(bytes).at(1, 1, 3), 1.0f);  // no alpha: opaque
    for (std::size_t size = 0; size < bytes.size(); size += 7)
        EXPECT_THROW(parseRawHeader(bytes.substr(0, size)), Refusal) << size;
    EXPECT_THROW(parseRawHeader(bytes + "x"), Refusal);
    for (const std::size_t at : {0, 8, 12, 24, 28, 48, 52, 56}) {
        std::string other = bytes;
        other[at] = char(other[at] ^ 0x55);
        EXPECT_THROW(readRaw(other), Refusal) << at;
    }
}

TEST(LruCache, HoldsNoMoreThanItMayAndDropsWhatWasAskedForTheLongestAgo)
{
    LruCache<int> cache(100);
    for (int i = 0; i < 10; ++i) cache.keep(std::to_string(i), std::make_shared<const int>(i), 10);
    EXPECT_EQ(cache.bytes(), 100u);
    EXPECT_NE(cache.find("0"), nullptr);  // asked for: now the latest
    cache.keep("new", std::make_shared<const int>(11), 15);
    EXPECT_EQ(cache.find("1"), nullptr);
    EXPECT_EQ(cache.find("2"), nullptr);
    EXPECT_EQ(*cache.find("0"), 0);
    cache.keep("huge", std::make_shared<const int>(1), 101);
    EXPECT_EQ(cache.find("huge"), nullptr);
    EXPECT_LE(cache.bytes(), 100u);
    cache.keep("0", std::make_shared<const int>(7), 20);  // in its place
    EXPECT_EQ(*cache.find("0"), 7);
}

TEST(SharedMemory, IsThereUntilItIsReleasedOrNewerOnesNeedItsRoom)
{
    SharedShelf shelf(3000, std::chrono::seconds(60));
    std::string first;
    {
        SharedBlock block(1000);
        first = block.name();
        EXPECT_TRUE(fs::exists(sharedPath(first)));
        shelf.keep(block);
    }
    EXPECT_TRUE(fs::exists(sharedPath(first)));
    for (int i = 0; i < 5; ++i) {
        SharedBlock block(1000);
        shelf.keep(block);
    }
    EXPECT_FALSE(fs::exists(sharedPath(first)));
    EXPECT_FALSE(shelf.release(first));
    EXPECT_LE(shelf.bytes(), 3000u);
    std::string unkept;
    {
        const SharedBlock block(10);
        unkept = block.name();
    }
    EXPECT_FALSE(fs::exists(sharedPath(unkept)));
    EXPECT_THROW(SharedBlock(std::size_t(1) << 50), Error);  // a disk that is full
}

TEST(SharedMemory, OfADeadServerIsSweptAndOfALivingOneIsNot)
{
    const std::string dead = sharedPath("virga-999999999-1-0"),
                      reborn = sharedPath(fmt::format("virga-{}-1-0", getpid()));
    for (const std::string& path : {dead, reborn}) std::ofstream(path) << "x";
    const SharedBlock living(10);
    sweepSharedMemory();
    EXPECT_FALSE(fs::exists(dead));
    EXPECT_FALSE(fs::exists(reborn));  // of a process that had our number before us
    EXPECT_TRUE(fs::exists(sharedPath(living.name())));
}

TEST(ServedFolder, NothingOutsideIsReached)
{
    const test::TemporaryFolder folder;
    const fs::path root = fs::path(folder.path()) / "root";
    fs::create_directories(root / "in");
    std::ofstream(root / "in" / "a.exr") << "x";
    std::ofstream(fs::path(folder.path()) / "secret.exr") << "x";
    fs::create_symlink("../secret.exr", root / "out.exr");
    fs::create_symlink("in/a.exr", root / "fine.exr");
    fs::create_directory_symlink("..", root / "up");
    const ServedFolder served(root.string());
    EXPECT_EQ(served.resolve("in/a.exr", "plate"), fs::canonical(root / "in" / "a.exr"));
    EXPECT_EQ(served.resolve("in/../fine.exr", "plate"), fs::canonical(root / "in" / "a.exr"));
    const auto status = [&](const std::string& name) {
        try {
            served.resolve(name, "plate");
            return 200;
        } catch (const Refusal& refusal) {
            return refusal.status();
        }
    };
    for (const char* name : {"../secret.exr", "out.exr", "up/secret.exr", "up", "..", "/etc/passwd",
                             "in/../../secret.exr", "../root2", "."})
        EXPECT_EQ(status(name), 403) << name;
    for (const char* name : {"none.exr", "", "in/a.%04d.exr", "in/a.exr/b"}) EXPECT_EQ(status(name), 404) << name;
    EXPECT_EQ(status("in"), 200);
    ASSERT_EQ(mkfifo((root / "pipe").c_str(), 0600), 0);
    EXPECT_EQ(status("pipe"), 404);  // would be waited for
}

TEST(Metrics, AreLinesOfPrometheus)
{
    Metrics metrics;
    metrics.countRequest("frame", 200, 0.02);
    metrics.countRequest("frame", 200, 0.3);
    const std::string text = metrics.text({});
    EXPECT_NE(text.find("virga_requests_total{route=\"frame\",status=\"200\"} 2\n"), std::string::npos);
    EXPECT_NE(text.find("virga_request_seconds_bucket{route=\"frame\",le=\"0.025\"} 1\n"), std::string::npos);
    EXPECT_NE(text.find("virga_request_seconds_bucket{route=\"frame\",le=\"+Inf\"} 2\n"), std::string::npos);
}

}  // namespace
}  // namespace virga::server
