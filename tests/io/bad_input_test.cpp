// Each thing that goes wrong gets one sentence with the name in it, and nothing is left lying about.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "io/Helpers.h"
#include "io/Plate.h"

namespace virga::io {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;

std::string openSentence(const std::string& path)
{
    return test::sentenceOf(ErrorCode::Input, [&] { openPlate(path, {}); });
}

std::size_t filesIn(const TemporaryFolder& folder)
{
    return std::size_t(std::distance(fs::directory_iterator(folder.path()), {}));
}

TEST(BadInput, IsNamed)
{
    const TemporaryFolder folder;
    std::ofstream(folder / "empty.mp4");
    std::ofstream(folder / "empty.exr");
    std::ofstream(folder / "text.mp4") << "It rained all day.\n";
    std::ofstream(folder / "text.exr") << "It rained all day.\n";
    test::run(fmt::format("ffmpeg -v error -f lavfi -i sine=440 -t 1 '{}'", folder / "sound.m4a"));
    fs::create_directory(folder / "shots");

    const struct {
        const char *name, *says;
    } cases[] = {{"missing.mp4", "does not exist"}, {"missing.exr", "does not exist"},
                 {"empty.mp4", "is empty"},         {"empty.exr", "is empty"},
                 {"text.mp4", "is not a movie"},    {"text.exr", "is not an image"},
                 {"sound.m4a", "holds no video"},   {"shots", "is a folder"},
                 {"a.%04d.exr", "no file matches"}, {"no/a.%04d.exr", "does not exist"}};
    for (const auto& c : cases) {
        const std::string sentence = openSentence(folder / c.name);
        EXPECT_SAYS(sentence, c.says);
        EXPECT_SAYS(sentence, folder / c.name);
        EXPECT_EQ(sentence.find('\n'), std::string::npos);
    }
    EXPECT_SAYS(openSentence(""), "no name");
    ReadOptions options;
    options.fps = -1;
    EXPECT_SAYS(test::sentenceOf(ErrorCode::InvalidArgument, [&] { openPlate(folder / "text.mp4", options); }), "-1");
}

// In one line, and without a word from the libraries themselves, which write to standard error on their own.
TEST(BadInput, CutOffAndDamagedImagesAreSaidInOneLine)
{
    const TemporaryFolder folder;
    const ImageF image = test::noise(64, 48, 3, 0, 1);
    writePng(folder / "a.png", image);
    writeExr(folder / "a.exr", image, {"R", "G", "B"}, true);
    for (const char* name : {"a.jpg", "a.tif", "a.tga", "a.bmp", "a.webp", "a.dpx", "a.hdr", "a.sgi", "a.ppm"})
        test::copyPlate(folder / "a.png", folder / name);
    for (const char* name :
         {"a.png", "a.exr", "a.jpg", "a.tif", "a.tga", "a.bmp", "a.webp", "a.dpx", "a.hdr", "a.sgi", "a.ppm"}) {
        const std::string part = folder / (std::string("part_") + name);
        for (const double share : {0.001, 0.01, 0.1, 0.5, 0.9}) {
            fs::copy_file(folder / name, part, fs::copy_options::overwrite_existing);
            fs::resize_file(part, std::max<std::uintmax_t>(1, std::uintmax_t(double(fs::file_size(part)) * share)));
            testing::internal::CaptureStderr();
            std::string said;
            try {
                openPlate(part, {})->read(0);  // JPEG and TGA are read as far as they go
            } catch (const Error& error) {
                EXPECT_EQ(int(error.code()), int(ErrorCode::Input)) << error.what();
                said = error.what();
                EXPECT_SAYS(said, part);
            }
            EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name << " " << share;
            EXPECT_EQ(said.find('\n'), std::string::npos) << said;
            if (std::string_view(name) == "a.png" && share > 0.005) {
                EXPECT_SAYS(said, "is damaged or cut off");
            }
        }
    }

    std::fstream(folder / "a.png", std::ios::in | std::ios::out | std::ios::binary).seekp(2000).put('\x55');
    EXPECT_SAYS(openSentence(folder / "a.png"), "the checksum of a chunk IDAT is wrong");
}

TEST(BadInput, FramesOutsideAreNamed)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 10);
    const auto reader = openPlate(folder / "in.mp4", {});
    for (const FrameNumber n : {FrameNumber(-1), FrameNumber(10), FrameNumber(1) << 40})
        EXPECT_SAYS(test::sentenceOf(ErrorCode::Input, [&] { reader->read(n); }), fmt::format("no frame {}", n));
    EXPECT_NO_THROW(reader->read(9));
}

// A movie that was cut off: what is there is read and the rest is named. No prefix of a file may crash or hang.
TEST(BadInput, CutOffMoviesAreReadAsFarAsTheyGo)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "a.mkv", "-c:v libx264 -g 10 -bf 2 -pix_fmt yuv420p", 40, "160x120");
    test::makeMovie(folder / "b.mp4", "-c:v libx264 -g 10 -bf 2 -pix_fmt yuv420p -movflags faststart", 40, "160x120");
    test::makeMovie(folder / "c.avi", "-c:v ffv1 -pix_fmt yuv420p", 40, "160x120");
    ReadOptions hold;
    hold.onError = OnError::Hold;
    for (const char* name : {"a.mkv", "b.mp4", "c.avi"}) {
        const auto size = fs::file_size(folder / name);
        std::size_t framesBefore = 0;
        for (const double share : {0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.999}) {
            const std::string part = folder / (std::string("part_") + name);
            fs::copy_file(folder / name, part, fs::copy_options::overwrite_existing);
            fs::resize_file(part, std::uintmax_t(double(size) * share));
            try {
                const auto reader = openPlate(part, hold);
                reader->schedule(reader->info().frames);
                for (const FrameNumber n : reader->info().frames) ASSERT_TRUE(reader->read(n).has_value());
                EXPECT_GE(reader->info().frames.size(), framesBefore) << name << share;
                framesBefore = reader->info().frames.size();
            } catch (const Error& error) {
                EXPECT_EQ(int(error.code()), int(ErrorCode::Input)) << error.what();
                EXPECT_SAYS(std::string(error.what()), part);
            }
        }
        EXPECT_GT(framesBefore, 30u) << name;
    }
}

TEST(BadInput, DamagedFramesAreNamedSkippedOrHeld)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mkv", "-c:v ffv1 -slicecrc 1 -level 3 -slices 4 -pix_fmt yuv420p", 12, "320x240");
    const auto good = openPlate(folder / "in.mkv", {});
    // One byte in the middle of the file is in the middle of one frame.
    {
        std::fstream file(folder / "in.mkv", std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(std::streamoff(fs::file_size(folder / "in.mkv") / 2));
        file.put('\x55');
        file.put('\xaa');
        file.put('\x5a');
    }
    ReadOptions skip, hold;
    skip.onError = OnError::Skip;
    hold.onError = OnError::Hold;
    const auto stopping = openPlate(folder / "in.mkv", {}), skipping = openPlate(folder / "in.mkv", skip),
               holding = openPlate(folder / "in.mkv", hold);
    std::vector<FrameNumber> bad;
    for (const FrameNumber n : stopping->info().frames) {
        try {
            stopping->read(n);
        } catch (const Error& error) {
            bad.push_back(n);
            EXPECT_SAYS(std::string(error.what()), fmt::format("frame {}", n));
        }
    }
    ASSERT_EQ(bad.size(), 1u);
    for (const FrameNumber n : skipping->info().frames) EXPECT_EQ(skipping->read(n).has_value(), n != bad[0]);
    EXPECT_TRUE(test::sameBits(holding->read(bad[0])->pixels, holding->read(bad[0] - 1)->pixels));
    EXPECT_SAYS(holding->read(bad[0])->repaired, fmt::format("held from frame {}", bad[0] - 1));

    // Left out of a movie, the others keep their times.
    EXPECT_EQ(test::copyPlate(folder / "in.mkv", folder / "out.mkv", {}, skip), 11u);
    EXPECT_EQ(test::frameHashes(folder / "out.mkv").size(), 11u);
}

// Where pictures build on one another, the damaged one is named with those that may show it.
TEST(BadInput, DamageInsideAGroupOfPicturesSaysHowFarItReaches)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -g 12 -bf 0 -sc_threshold 0 -pix_fmt yuv420p", 36, "320x240");
    {
        std::fstream file(folder / "in.mp4", std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(std::streamoff(fs::file_size(folder / "in.mp4") / 2));
        file << std::string(40, '\x5a');
    }
    const auto reader = openPlate(folder / "in.mp4", {});
    std::string said;
    for (const FrameNumber n : reader->info().frames) {
        try {
            reader->read(n);
        } catch (const Error& error) {
            said += error.what();
        }
    }
    EXPECT_SAYS(said, "is damaged; frames up to 23 build on it");
}

// Flipped bits anywhere: an Error or pictures, nothing else.
TEST(BadInput, FlippedBitsNeverCrash)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "a.mp4", "-c:v libx264 -g 5 -pix_fmt yuv420p", 10);
    test::makeMovie(folder / "b.mov", "-c:v prores_ks", 3);
    writeExr(folder / "c.exr", test::noise(40, 30, 4, 0, 1), {"R", "G", "B", "A"}, true);
    writePng(folder / "d.png", test::noise(40, 30, 4, 0, 1));
    std::mt19937 random(99);
    for (const char* name : {"a.mp4", "b.mov", "c.exr", "d.png"}) {
        std::ifstream source(folder / name, std::ios::binary);
        const std::string bytes((std::istreambuf_iterator<char>(source)), {});
        for (int round = 0; round < 25; ++round) {
            std::string damaged = bytes;
            for (int flip = 0; flip < 8; ++flip) damaged[random() % damaged.size()] ^= char(1 << (random() % 8));
            const std::string path = folder / (std::string("damaged_") + name);
            std::ofstream(path, std::ios::binary) << damaged;
            ReadOptions skip;
            skip.onError = OnError::Skip;
            try {
                const auto reader = openPlate(path, skip);
                // A header that lies about its size may ask for more memory than there is sense in giving.
                if (double(reader->info().width) * reader->info().height > 1e7) continue;
                for (const FrameNumber n : reader->info().frames) reader->read(n);
            } catch (const Error& error) {
                EXPECT_TRUE(error.code() == ErrorCode::Input) << error.what();
            }
        }
    }
}

// ---- outputs

TEST(BadOutput, IsRefusedBeforeAnythingIsRendered)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 3);
    const auto reader = openPlate(folder / "in.mp4", {});
    const std::size_t before = filesIn(folder);
    const struct {
        const char *name, *says;
        ErrorCode code;
    } cases[] = {{"no/out.mp4", "does not exist", ErrorCode::Output},
                 {"in.mp4", "is the plate itself", ErrorCode::Output},
                 {"./in.mp4", "is the plate itself", ErrorCode::Output},
                 {"in.mp4/out.mp4", "is not a folder", ErrorCode::Output},
                 {"out.xyz", ".xyz", ErrorCode::Output},
                 {"out", "no format that can be written", ErrorCode::Output},
                 {"out.%04d.xyz", ".exr", ErrorCode::Output},
                 {"out.mp3", "'.mp3' is no format that can be written; there are .exr, .png", ErrorCode::Output},
                 {"out.flac", ".mp4, .mov", ErrorCode::Output},
                 {"out.aiff", "no format that can be written", ErrorCode::Output},
                 {"out.m3u8", "no format that can be written", ErrorCode::Output},
                 {"out.gif", "'.gif' is no format that can be written; there are .exr, .png", ErrorCode::Output},
                 {"out.%04d.zfile", "no format that can be written", ErrorCode::Output},
                 {"out.iff", "no format that can be written", ErrorCode::Output}};
    for (const auto& c : cases) {
        const std::string sentence = test::sentenceOf(c.code, [&] { createPlateWriter(folder / c.name, *reader, {}); });
        EXPECT_SAYS(sentence, c.says);
        EXPECT_SAYS(sentence, c.name);
    }
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter(folder.path().string(), *reader, {}); }),
                "is a folder");
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter("", *reader, {}); }), "no name");

    const auto withCodec = [&](const char* name, const char* codec) {
        WriteOptions options;
        options.codec = codec;
        return test::sentenceOf(ErrorCode::InvalidArgument,
                                [&] { createPlateWriter(folder / name, *reader, options); });
    };
    EXPECT_SAYS(withCodec("out.mp4", "x246"), "'x246' is not known");
    EXPECT_SAYS(withCodec("out.mp4", "x246"), "libx264");
    EXPECT_SAYS(withCodec("out.mp4", "prores_ks"), "cannot be put into");
    EXPECT_SAYS(withCodec("out.mp4", "aac"), "'aac' is not known");
    EXPECT_SAYS(withCodec("out.%04d.exr", "libx264"), "piz");
    EXPECT_SAYS(withCodec("out.%04d.png", "libx264"), "none to choose");
    WriteOptions options;
    options.outputColorspace = "Rec.1234";
    EXPECT_SAYS(
        test::sentenceOf(ErrorCode::InvalidArgument, [&] { createPlateWriter(folder / "o.mp4", *reader, options); }),
        "'Rec.1234'");
    options = {};
    options.layers = true;
    EXPECT_SAYS(
        test::sentenceOf(ErrorCode::InvalidArgument, [&] { createPlateWriter(folder / "o.mp4", *reader, options); }),
        "EXR");
    EXPECT_EQ(filesIn(folder), before);
}

TEST(BadOutput, AFolderThatCannotBeWrittenToIsNamed)
{
    if (geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 3);
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    const auto reader = openPlate(folder / "in.mp4", {});
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter(folder / "locked/out.mp4", *reader, {}); }),
                "locked");
}

TEST(BadOutput, TheSequenceItselfIsNotWrittenOver)
{
    const TemporaryFolder folder;
    for (int i = 1; i <= 3; ++i)
        writeExr(framePath(folder / "a.####.exr", i), ImageF(4, 4, 4), {"R", "G", "B", "A"}, true);
    const auto reader = openPlate(folder / "a.####.exr", {});
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter(folder / "a.%04d.exr", *reader, {}); }),
                "plate itself");
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { createPlateWriter(folder / "a.0002.exr", *reader, {}); }),
                "plate itself");
    // Several frames do not go into one image.
    const auto writer = createPlateWriter(folder / "one.exr", *reader, {});
    writer->write({1, ImageF(4, 4, 4), {}, nullptr});
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output,
                                 [&] {
                                     writer->write({2, ImageF(4, 4, 4), {}, nullptr});
                                 }),
                "pattern");
}

// No file of this process grows over 1000 bytes, which writers meet as they meet a full disk (tests/cli has that).
TEST(BadOutput, AFullDiskIsSaid)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 3);
    const auto reader = openPlate(folder / "in.mp4", {});
    const virga::test::FileSizeLimit limit(1000);
    const auto renderTo = [&](const char* name) {
        const auto writer = createPlateWriter(folder / name, *reader, {});
        for (const FrameNumber n : reader->info().frames)
            writer->write({n, std::move(reader->read(n)->pixels), {}, nullptr});
        writer->finish();
    };
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { renderTo("out.mkv"); }), "out.mkv");
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Output, [&] { renderTo("out.%04d.exr"); }), ".exr: cannot be written");
    EXPECT_EQ(filesIn(folder), 1u);
}

}  // namespace
}  // namespace virga::io
