// A name is a whole file's or nobody's; what is being made, by however many, and what the dead left can be told apart.

#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "io/AtomicFile.h"
#include "io/Plate.h"
#include "support/Files.h"

namespace virga::io {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;
using Names = std::vector<std::string>;

std::string contentOf(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::size_t filesIn(const TemporaryFolder& folder)
{
    return std::size_t(std::distance(fs::directory_iterator(folder.path()), {}));
}

TEST(AtomicFile, LiesHiddenBesideItsNameWithItsEndingUntilItIsWhole)
{
    const TemporaryFolder folder;
    std::string longest(251, 'x');
    longest += ".exr";
    for (const std::string& name :
         {std::string("out.mp4"), std::string("out.0001.exr"), std::string("out"), longest, std::string(".exr")}) {
        std::string temporary;
        {
            const AtomicFile file(folder / name);
            temporary = file.temporaryPath();
            EXPECT_TRUE(fs::is_regular_file(temporary));
            EXPECT_EQ(fs::path(temporary).parent_path(), fs::path(folder.path()));
            EXPECT_EQ(fs::path(temporary).filename().string().front(), '.');
            EXPECT_TRUE(temporary.ends_with(fs::path(name).extension().string())) << temporary;
            EXPECT_FALSE(fs::exists(folder / name));
        }
        EXPECT_EQ(filesIn(folder), 0u) << name;
        AtomicFile file(folder / name);
        std::ofstream(file.temporaryPath()) << name;
        file.commit();
        EXPECT_EQ(contentOf(folder / name), name);
        EXPECT_EQ(filesIn(folder), 1u) << name;
        fs::remove(folder / name);
    }
}

TEST(AtomicFile, OfManyToOneNameEachIsItsOwn)
{
    const TemporaryFolder folder;
    std::set<std::string> names;
    {
        AtomicFile first(folder / "out.mkv"), second(folder / "out.mkv"), third(folder / "out.mkv", "finishing");
        names = {first.temporaryPath(), second.temporaryPath(), third.temporaryPath()};
        EXPECT_EQ(names.size(), 3u);
        for (const AtomicFile* file : {&first, &second, &third}) std::ofstream(file->temporaryPath()) << file;
        const std::string wantedFirst = contentOf(first.temporaryPath()), wanted = contentOf(second.temporaryPath());
        first.commit();
        EXPECT_EQ(contentOf(folder / "out.mkv"), wantedFirst);
        second.commit();
        EXPECT_EQ(contentOf(folder / "out.mkv"), wanted);
        EXPECT_TRUE(fs::exists(third.temporaryPath()));
    }
    EXPECT_EQ(filesIn(folder), 1u);
}

// What has the name that would be next is neither overwritten nor removed.
TEST(AtomicFile, TakesNoNameThatIsTaken)
{
    const TemporaryFolder folder;
    std::string next;
    {
        const AtomicFile file(folder / "out.mkv");
        const std::string name = file.temporaryPath();
        const std::size_t end = name.rfind('.'), begin = name.rfind('-') + 1;
        next = name.substr(0, begin) + std::to_string(std::stoul(name.substr(begin, end - begin)) + 1) + ".mkv";
    }
    std::ofstream(next) << "somebody's";
    {
        const AtomicFile file(folder / "out.mkv");
        EXPECT_NE(file.temporaryPath(), next);
    }
    EXPECT_EQ(contentOf(next), "somebody's");
}

TEST(AtomicFile, SaysWhereNothingCanBeMade)
{
    const TemporaryFolder folder;
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { AtomicFile(folder / "no/out.mkv"); }), "no/out.mkv");
    fs::create_directory(folder / "taken");
    std::ofstream(folder / "taken/by this");
    AtomicFile file(folder / "taken");
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { file.commit(); }), "taken: cannot be given its name");
}

TEST(Leftovers, AreFilesOfTheDeadAlone)
{
    const TemporaryFolder folder;
    const std::string left = folder.write(".out.partial-host-1-2.mkv", "half");
    const std::string finishing = folder.write(".out.finishing-a-b-1-2.mkv", "half");
    for (const char* other :
         {".out2.partial-host-1-2.mkv", ".out.partial-host-1-2.mp4", ".out.partial.mkv", "out.partial-host-1-2.mkv",
          ".out.partial-host-1-x.mkv", ".out.partial-1-2.mkv", ".a.out.partial-host-1-2.mkv", ".out.partial-.mkv"})
        folder.write(other, "not of this output");
    fs::create_symlink(left, folder / ".out.partial-host-3-3.mkv");
    fs::create_directory(folder / ".out.partial-host-4-4.mp4");
    const AtomicFile living(folder / "out.mkv");
    EXPECT_EQ(findLeftovers(folder / "out.mkv"), (Names{finishing, left}));
    EXPECT_EQ(findLeftovers("none/out.mkv"), Names{});

    const std::size_t before = filesIn(folder);
    removeLeftovers({left, finishing, living.temporaryPath(), folder / "none"});
    EXPECT_EQ(filesIn(folder), before - 2);
    EXPECT_TRUE(fs::exists(living.temporaryPath()));
}

TEST(Leftovers, OfASequenceAreThoseOfItsFrames)
{
    const TemporaryFolder folder;
    const std::string first = folder.write(".s.0001.partial-h-1-2.exr", ""),
                      second = folder.write(".s.0123.partial-h-1-3.exr", "");
    folder.write(".s.1.partial-h-1-2.exr", "");
    folder.write(".t.0001.partial-h-1-2.exr", "");
    folder.write(".s.0001.partial-h-1-2.png", "");
    const AtomicFile living(folder / "s.0002.exr");
    EXPECT_EQ(findLeftovers(folder / "s.%04d.exr"), (Names{first, second}));
    EXPECT_EQ(findLeftovers(folder / "s.####.exr"), (Names{first, second}));
    EXPECT_EQ(findLeftovers(folder / "s.0001.exr"), (Names{first}));
    sweepLeftovers(folder / "s.%04d.exr");
    EXPECT_EQ(findLeftovers(folder / "s.%04d.exr"), Names{});
    EXPECT_TRUE(fs::exists(living.temporaryPath()));
}

TEST(Leftovers, AreThoseOfAKilledProcess)
{
    const TemporaryFolder folder;
    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
        const AtomicFile file(folder / "out.mkv");
        [[maybe_unused]] const ssize_t told = write(ready[1], "!", 1);
        for (;;) pause();
    }
    char byte;
    ASSERT_EQ(read(ready[0], &byte, 1), 1);
    EXPECT_EQ(filesIn(folder), 1u);
    EXPECT_EQ(findLeftovers(folder / "out.mkv"), Names{}) << "its maker lives";
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    EXPECT_EQ(findLeftovers(folder / "out.mkv").size(), 1u);
    removeLeftovers(findLeftovers(folder / "out.mkv"));
    EXPECT_EQ(filesIn(folder), 0u);
    close(ready[0]);
    close(ready[1]);
}

// A library that replaced the file by another of its name would lose the lock, and so what tells it from a leftover.
TEST(AtomicFile, IsTheOneThatImageLibrariesWrite)
{
    const TemporaryFolder folder;
    const ImageF image(8, 8, 4);
    writePng(folder / "plate.png", image);
    const auto reader = openPlate(folder / "plate.png", {});
    const int watch = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    inotify_add_watch(watch, folder.path().c_str(), IN_CREATE | IN_DELETE);
    for (const char* name :
         {"a.exr", "a.png", "a.jpg", "a.tif", "a.dpx", "a.hdr", "a.webp", "a.tga", "a.bmp", "a.sgi", "a.ppm"}) {
        const auto writer = createPlateWriter(folder / name, *reader, {});
        writer->write({0, ImageF(8, 8, 4), {}, nullptr});
        writer->finish();
        EXPECT_TRUE(fs::exists(folder / name));
        alignas(inotify_event) char events[4096];
        const ssize_t bytes = read(watch, events, sizeof events);
        ASSERT_GT(bytes, 0);
        const auto* first = reinterpret_cast<const inotify_event*>(events);
        EXPECT_EQ(first->mask, std::uint32_t(IN_CREATE)) << name;
        EXPECT_EQ(std::size_t(bytes), sizeof *first + first->len) << name << ": made or removed more than once";
    }
    close(watch);
}

TEST(WholeFile, IsThereOrNotAtAll)
{
    const TemporaryFolder folder;
    writeWholeFile(folder / "a.txt", "first");
    {
        const test::FileSizeLimit limit(1000);
        EXPECT_SAYS(
            test::sentenceOf(ErrorCode::Output, [&] { writeWholeFile(folder / "a.txt", std::string(5000, 'x')); }),
            "a.txt: cannot be written (File too large)");
    }
    EXPECT_EQ(contentOf(folder / "a.txt"), "first");
    writeWholeFile(folder / "a.txt", "second");
    EXPECT_EQ(contentOf(folder / "a.txt"), "second");
    EXPECT_EQ(filesIn(folder), 1u);
}

TEST(OutputFolder, PipesAndDevicesAreNotReplaced)
{
    const TemporaryFolder folder;
    ASSERT_EQ(mkfifo((folder / "out.mkv").c_str(), 0600), 0);
    for (const std::string& path : {folder / "out.mkv", std::string("/dev/null")})
        EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { checkOutputFolder(path); }), "is a pipe or a device");
}

}  // namespace
}  // namespace virga::io
