#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "io/Helpers.h"
#include "io/Plate.h"

namespace virga::io {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;

std::string probe(const std::string& path, const std::string& what)
{
    std::string text = test::run(
        fmt::format("ffprobe -v error -select_streams v:0 -show_entries {} -of default=nw=1:nk=1 '{}'", what, path));
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
}

std::string packetHash(const std::string& path, const std::string& stream)
{
    return test::run(fmt::format("ffmpeg -v error -i '{}' -map 0:{} -c copy -f md5 -", path, stream));
}

std::vector<double> frameTimes(const std::string& path)
{
    std::istringstream lines(probe(path, "frame=pts_time"));
    std::vector<double> times;
    for (double time = 0; lines >> time;) times.push_back(time);
    return times;
}

// What nobody touches comes back to the code, in the format that the plate has.
TEST(MovieRoundTrip, EveryPixelFormatComesBackThroughFfv1)
{
    const TemporaryFolder folder;
    std::vector<std::pair<std::string, std::string>> pairs;
    std::string outputs;
    for (const char* format :
         {"yuv420p",     "yuv422p",     "yuv444p",     "yuv440p",     "yuv411p",     "yuv410p",     "yuv420p9le",
          "yuv420p10le", "yuv422p10le", "yuv444p10le", "yuv420p12le", "yuv422p12le", "yuv444p14le", "yuv420p16le",
          "yuv422p16le", "yuv444p16le", "gray",        "gray9le",     "gray10le",    "gray12le",    "gray16le",
          "gbrp9le",     "gbrp10le",    "gbrp12le",    "gbrp14le",    "gbrp16le",    "bgr0"}) {
        for (const char* range : {"tv", "pc"}) {
            const std::string in = folder / fmt::format("{}.{}.mkv", format, range);
            pairs.emplace_back(in, in + ".out.mkv");
            outputs += fmt::format(" -frames:v 2 -c:v ffv1 -pix_fmt {} -color_range {} '{}'", format, range, in);
        }
    }
    test::run("ffmpeg -v error -f lavfi -i testsrc2=size=70x50,noise=alls=30:allf=t" + outputs);
    for (const auto& [in, out] : pairs) {
        test::copyPlate(in, out);
        EXPECT_EQ(openPlate(in, {})->info().format, openPlate(out, {})->info().format);
    }
    test::expectSameFrames(pairs);
}

TEST(MovieRoundTrip, AlphaComesBack)
{
    const TemporaryFolder folder;
    for (const char* format :
         {"yuva420p", "yuva422p", "yuva444p", "yuva444p10le", "yuva420p16le", "gbrap10le", "gbrap16le", "bgra"}) {
        const bool isRgb = format[0] != 'y';
        test::run(
            fmt::format("ffmpeg -v error -y -f lavfi -i \"testsrc2=size=64x48,format={},geq={}:a='1+mod(7*X+Y,200)'\" "
                        "-frames:v 2 -c:v ffv1 -pix_fmt {} '{}'",
                        isRgb ? "gbrap" : format, isRgb ? "r='r(X,Y)':g='g(X,Y)':b='b(X,Y)'" : "lum='p(X,Y)'", format,
                        folder / "in.mkv"));
        const auto reader = openPlate(folder / "in.mkv", {});
        EXPECT_TRUE(reader->info().hasAlpha) << format;
        test::copyPlate(folder / "in.mkv", folder / "out.mkv");
        EXPECT_EQ(test::frameHashes(folder / "in.mkv"), test::frameHashes(folder / "out.mkv")) << format;
    }
}

// Packed pixels are repacked into planes on the way in, and no bit is lost.
TEST(MovieRoundTrip, PackedPixelsAreReadExactly)
{
    const TemporaryFolder folder;
    const struct {
        const char *packed, *planar;
    } cases[] = {{"nv12", "yuv420p"}, {"yuyv422", "yuv422p"},    {"uyvy422", "yuv422p"},  {"p010le", "yuv420p10le"},
                 {"rgb24", "gbrp"},   {"bgr24", "gbrp"},         {"0rgb", "gbrp"},        {"rgb48le", "gbrp16le"},
                 {"rgba", "gbrap"},   {"rgba64le", "gbrap16le"}, {"gray16be", "gray16le"}};
    for (const auto& c : cases) {
        test::makeMovie(folder / "in.nut", fmt::format("-c:v rawvideo -pix_fmt {}", c.packed), 2);
        WriteOptions options;
        options.codec = "rawvideo";
        test::copyPlate(folder / "in.nut", folder / "out.nut", options);
        const std::string asPlanar = fmt::format("-pix_fmt {}", c.planar);
        EXPECT_EQ(test::frameHashes(folder / "in.nut", asPlanar), test::frameHashes(folder / "out.nut", asPlanar))
            << c.packed;
    }
}

TEST(MovieRoundTrip, LosslessH264ComesBack)
{
    const TemporaryFolder folder;
    for (const char* format : {"yuv420p", "yuv422p", "yuv444p", "gray"}) {
        test::makeMovie(folder / "in.mp4", fmt::format("-c:v libx264 -qp 0 -pix_fmt {}", format), 5);
        WriteOptions options;
        options.quality = 0;
        test::copyPlate(folder / "in.mp4", folder / "out.mp4", options);
        EXPECT_EQ(test::frameHashes(folder / "in.mp4"), test::frameHashes(folder / "out.mp4")) << format;
    }
}

TEST(MovieRoundTrip, ColourTagsAreKept)
{
    const TemporaryFolder folder;
    const char* const entries = "stream=color_range,color_space,color_transfer,color_primaries,pix_fmt";
    for (const char* tags :
         {"-color_range tv -colorspace bt709 -color_trc bt709 -color_primaries bt709",
          "-color_range pc -colorspace bt709 -color_trc bt709 -color_primaries bt709",
          "-color_range tv -colorspace smpte170m -color_trc smpte170m -color_primaries smpte170m",
          "-color_range tv -colorspace bt470bg -color_trc bt709 -color_primaries bt470bg",
          "-color_range tv -colorspace bt2020nc -color_trc smpte2084 -color_primaries bt2020 -pix_fmt yuv420p10le",
          "-color_range tv -colorspace bt2020nc -color_trc arib-std-b67 -color_primaries bt2020 -pix_fmt "
          "yuv420p10le"}) {
        for (const char* name : {"in.mp4", "in.mkv", "in.mov"}) {
            test::makeMovie(folder / name, fmt::format("-c:v libx264 -qp 0 {}", tags), 2);
            const std::string out = folder / (std::string("out_") + name);
            test::copyPlate(folder / name, out);
            EXPECT_EQ(probe(folder / name, entries), probe(out, entries)) << tags << " " << name;
        }
    }
}

// The colours themselves, against ffmpeg's own conversion to R'G'B' of pictures without shared chroma.
TEST(MovieColour, AgreesWithFfmpeg)
{
    const TemporaryFolder folder;
    const struct {
        const char *matrix, *ffmpegName, *range;
    } cases[] = {
        {"bt709", "bt709", "tv"}, {"smpte170m", "bt601", "tv"}, {"bt709", "bt709", "pc"}, {"bt2020nc", "bt2020", "tv"}};
    for (const auto& c : cases) {
        test::makeMovie(
            folder / "in.mkv",
            fmt::format("-vf scale=out_color_matrix={}:out_range={} -c:v ffv1 -pix_fmt yuv444p16le -colorspace {} "
                        "-color_range {} -color_trc bt709 -color_primaries bt709",
                        c.ffmpegName, c.range, c.matrix, c.range),
            1, "64x48", "smptebars");
        test::copyPlate(folder / "in.mkv", folder / "ours.%d.png");
        test::run(fmt::format(
            "ffmpeg -v error -y -i '{}' -vf scale=in_color_matrix={}:in_range={}:flags=accurate_rnd+full_chroma_int "
            "-pix_fmt rgb48be -frames:v 1 '{}'",
            folder / "in.mkv", c.ffmpegName, c.range, folder / "theirs.png"));
        const ImageF ours = readRawImage(folder / "ours.0.png").pixels,
                     theirs = readRawImage(folder / "theirs.png").pixels;
        ASSERT_EQ(ours.channels(), 3);
        for (std::size_t i = 0; i < ours.size(); ++i)
            ASSERT_NEAR(ours.data()[i], theirs.data()[i], 65535 * 0.004)
                << c.matrix << " " << c.range << " " << i;  // swscale: 8-bit matrix
    }
}

// Primaries go with the light into EXR files, and from there into what is made of them.
TEST(MovieColour, PrimariesGoAlong)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mkv",
                    "-c:v ffv1 -pix_fmt yuv444p16le -colorspace bt2020nc -color_trc smpte2084 -color_primaries bt2020",
                    1);
    const auto reader = openPlate(folder / "in.mkv", {});
    EXPECT_EQ(reader->info().colorspace, "Rec.2020 PQ");
    EXPECT_EQ(reader->info().workingColorspace, "Linear Rec.2020");
    test::copyPlate(folder / "in.mkv", folder / "light.%04d.exr");
    EXPECT_EQ(openPlate(folder / "light.%04d.exr", {})->info().colorspace, "Linear Rec.2020");
    WriteOptions options;
    options.outputColorspace = "ACEScg";
    test::copyPlate(folder / "light.%04d.exr", folder / "aces.%04d.exr", options);
    EXPECT_EQ(openPlate(folder / "aces.%04d.exr", {})->info().colorspace, "ACEScg");
    options.outputColorspace = "Rec.2020 PQ";
    test::copyPlate(folder / "aces.%04d.exr", folder / "out.mp4", options);
    EXPECT_EQ(probe(folder / "out.mp4", "stream=color_space,color_transfer,color_primaries"),
              "bt2020nc\nsmpte2084\nbt2020");
}

// ---- frames by number

struct SeekCase {
    const char* name;
    const char* arguments;
    const char* filter;
};

class MovieSeek : public testing::TestWithParam<SeekCase> {};

TEST_P(MovieSeek, AnyOrderGivesTheFramesOfTheSequence)
{
    const TemporaryFolder folder;
    const std::string path = folder / GetParam().name;
    test::makeMovie(path, fmt::format("{} {}", GetParam().filter, GetParam().arguments), 50);
    const auto inOrder = openPlate(path, {});
    ASSERT_EQ(inOrder->info().frames.size(), 50u);
    inOrder->schedule(inOrder->info().frames);
    std::vector<ImageF> frames;
    for (const FrameNumber n : inOrder->info().frames) frames.push_back(inOrder->read(n)->pixels);
    for (std::size_t i = 1; i < frames.size(); ++i) ASSERT_FALSE(test::sameBits(frames[i], frames[i - 1])) << i;

    // Each frame is the picture that ffmpeg shows at that place.
    test::copyPlate(path, folder / "all.nut",
                    {.outputColorspace = {}, .codec = "rawvideo", .quality = {}, .half = {}, .layers = false});
    ASSERT_EQ(test::frameHashes(path), test::frameHashes(folder / "all.nut"));

    std::vector<FrameNumber> order = inOrder->info().frames;
    std::shuffle(order.begin(), order.end(), std::mt19937(11));
    const auto alone = openPlate(path, {});
    for (const FrameNumber n : order) ASSERT_TRUE(test::sameBits(alone->read(n)->pixels, frames[std::size_t(n)])) << n;
    const auto backwards = openPlate(path, {});
    std::sort(order.rbegin(), order.rend());
    backwards->schedule(order);
    for (const FrameNumber n : order)
        ASSERT_TRUE(test::sameBits(backwards->read(n)->pixels, frames[std::size_t(n)])) << n;
    const auto last = openPlate(path, {})->read(49);  // alone, from nothing
    ASSERT_TRUE(test::sameBits(last->pixels, frames[49]));
}

INSTANTIATE_TEST_SUITE_P(
    Codecs, MovieSeek,
    testing::Values(
        SeekCase{"bframes.mp4", "-c:v libx264 -g 12 -bf 3 -pix_fmt yuv420p", ""},
        SeekCase{"opengop.mp4",
                 "-c:v libx264 -x264-params open-gop=1:keyint=10:bframes=4:b-pyramid=normal -pix_fmt yuv420p", ""},
        SeekCase{"opengop.mkv", "-c:v libx264 -x264-params open-gop=1:keyint=10:bframes=4 -pix_fmt yuv420p", ""},
        SeekCase{"variable.mp4", "-c:v libx264 -g 9 -bf 2 -pix_fmt yuv420p -fps_mode vfr",
                 "-vf settb=1/1000,setpts='N*40+15*mod(N\\,3)'"},
        SeekCase{"variable.mkv", "-c:v libx264 -g 9 -bf 2 -pix_fmt yuv420p -fps_mode vfr",
                 "-vf settb=1/1000,setpts='N*40+15*mod(N\\,3)'"},
        SeekCase{"hevc.mp4", "-c:v libx265 -x265-params keyint=10:log-level=none -pix_fmt yuv420p10le", ""},
        SeekCase{"stream.ts", "-c:v libx264 -g 12 -bf 2 -pix_fmt yuv420p", ""},
        SeekCase{"mpeg2.mpg", "-c:v mpeg2video -g 12 -bf 2 -q:v 2", ""},
        SeekCase{"vp9.webm", "-c:v libvpx-vp9 -g 12 -cpu-used 8 -deadline realtime", ""},
        SeekCase{"mjpeg.avi", "-c:v mjpeg -q:v 2", ""}, SeekCase{"prores.mov", "-c:v prores_ks", ""},
        SeekCase{"mpeg4.avi", "-c:v mpeg4 -g 12 -q:v 2", ""},
        SeekCase{"raw.h264", "-c:v libx264 -g 12 -bf 2 -pix_fmt yuv420p", ""}),
    [](const auto& info) {
        std::string name = info.param.name;
        std::replace(name.begin(), name.end(), '.', '_');
        return name;
    });

TEST(MovieTime, VariableRatesKeepTheirTimeStamps)
{
    const TemporaryFolder folder;
    for (const char* name : {"in.mp4", "in.mkv", "in.mov"}) {
        test::makeMovie(folder / name,
                        "-vf settb=1/1000,setpts='N*40+15*mod(N\\,3)' -c:v libx264 -fps_mode vfr -pix_fmt yuv420p", 30);
        EXPECT_TRUE(openPlate(folder / name, {})->info().isVariableRate);
        for (const char* other : {"out.mp4", "out.mkv"}) {
            test::copyPlate(folder / name, folder / other);
            const auto before = frameTimes(folder / name), after = frameTimes(folder / other);
            ASSERT_EQ(before.size(), 30u);
            ASSERT_EQ(after.size(), 30u);
            for (std::size_t i = 0; i < 30; ++i) ASSERT_NEAR(after[i], before[i], 0.00051) << name << " " << other;
        }
    }
}

TEST(MovieTime, RegularRatesStayRegular)
{
    const TemporaryFolder folder;
    for (const char* rate : {"24000/1001", "25", "30000/1001", "60"}) {
        test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 10, "64x48", "testsrc2", rate);
        test::copyPlate(folder / "in.mp4", folder / "out.mov");
        EXPECT_EQ(probe(folder / "out.mov", "stream=r_frame_rate,avg_frame_rate,nb_frames"),
                  probe(folder / "in.mp4", "stream=r_frame_rate,avg_frame_rate,nb_frames"));
        EXPECT_EQ(frameTimes(folder / "in.mp4"), frameTimes(folder / "out.mov"));
    }
    ReadOptions options;
    options.fps = 12;
    options.firstFrame = 1001;
    const auto reader = openPlate(folder / "in.mp4", options);
    EXPECT_EQ(reader->info().fps, 12);
    EXPECT_EQ(reader->info().frames.front(), 1001);
    EXPECT_NEAR(reader->read(1004)->time_s, 0.25, 1e-9);
}

// ---- what else is in the file

TEST(MovieSound, IsCopiedPacketByPacket)
{
    const TemporaryFolder folder;
    const std::string sound =
        "-f lavfi -i sine=440:sample_rate=48000 -f lavfi -i sine=880 -shortest -t 2 -map 0:v -map 1:a -map 2:a";
    test::makeMovie(folder / "in.mp4", sound + " -c:v libx264 -pix_fmt yuv420p -c:a aac -metadata:s:a:1 language=fra",
                    50);
    test::makeMovie(folder / "pcm.mov", sound + " -c:v prores_ks -c:a pcm_s24le", 50);
    test::makeMovie(folder / "flac.mkv", sound + " -c:v ffv1 -c:a flac", 50);
    const struct {
        const char *in, *out;
    } cases[] = {{"in.mp4", "a.mp4"},  {"in.mp4", "a.mkv"},  {"in.mp4", "a.mov"},
                 {"pcm.mov", "b.mov"}, {"pcm.mov", "b.mkv"}, {"flac.mkv", "c.mkv"}};
    for (const auto& c : cases) {
        test::copyPlate(folder / c.in, folder / c.out);
        EXPECT_EQ(probe(folder / c.in, "format=nb_streams"), probe(folder / c.out, "format=nb_streams"))
            << c.in << c.out;
        EXPECT_EQ(test::frameHashes(folder / c.in).size(), test::frameHashes(folder / c.out).size());
        for (const char* stream : {"a:0", "a:1"})
            EXPECT_EQ(packetHash(folder / c.in, stream), packetHash(folder / c.out, stream)) << c.in << " " << c.out;
    }
    EXPECT_SAYS(
        test::run(fmt::format("ffprobe -v error -show_entries stream_tags=language -of csv '{}'", folder / "a.mkv")),
        "fra");
}

TEST(MovieSound, IsCutWithTheFrames)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4",
                    "-f lavfi -i sine=440:sample_rate=48000 -t 2 -c:v libx264 -pix_fmt yuv420p -c:a aac", 50);
    std::vector<FrameNumber> some;
    for (FrameNumber n = 10; n < 35; ++n) some.push_back(n);
    for (const char* name : {"cut.mp4", "cut.mkv", "cut.mov"}) {
        test::copyPlate(folder / "in.mp4", folder / name, {}, {}, some);
        EXPECT_EQ(test::frameHashes(folder / name).size(), 25u);
        EXPECT_NEAR(frameTimes(folder / name).front(), 0, 0.03);
        std::istringstream times(test::run(
            fmt::format("ffprobe -v error -select_streams a -show_entries packet=pts_time -of default=nw=1:nk=1 '{}'",
                        folder / name)));
        std::vector<double> packets;
        for (double time = 0; times >> time;) packets.push_back(time);
        ASSERT_FALSE(packets.empty());
        // What the decoder has to hear first lies before the zero, or is discarded at it.
        EXPECT_LE(packets.front(), 0) << name;
        EXPECT_GE(packets.front(), -0.1 - 0.03) << name;
        EXPECT_NEAR(packets.back(), 1 - 0.02, 0.03) << name;
    }
}

TEST(MovieSound, WhatAContainerCannotHoldIsLeftOut)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mov", "-f lavfi -i sine=440 -t 1 -c:v libx264 -pix_fmt yuv420p -c:a pcm_s16le", 25);
    test::copyPlate(folder / "in.mov", folder / "out.mp4");
    EXPECT_EQ(probe(folder / "out.mp4", "format=nb_streams"), "1");
    EXPECT_EQ(test::frameHashes(folder / "out.mp4").size(), 25u);
}

TEST(MovieMetadata, TimecodeAndTitleAreKeptAndCountOn)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mov",
                    "-c:v prores_ks -timecode 01:00:00:20 -metadata title='Wet street' -metadata comment=take3", 12);
    test::copyPlate(folder / "in.mov", folder / "whole.mov");
    test::copyPlate(folder / "in.mov", folder / "part.mov", {}, {}, {6, 7, 8});
    const auto timecode = [&](const char* name) { return probe(folder / name, "stream_tags=timecode"); };
    EXPECT_EQ(timecode("whole.mov"), "01:00:00:20");
    EXPECT_EQ(timecode("part.mov"), "01:00:01:01");  // 20 + 6 at 25 frames a second
    EXPECT_EQ(probe(folder / "whole.mov", "format_tags=title,comment"), "Wet street\ntake3");
    EXPECT_EQ(probe(folder / "whole.mov", "stream=codec_name,pix_fmt,profile"),
              probe(folder / "in.mov", "stream=codec_name,pix_fmt,profile"));
}

TEST(MovieMetadata, PixelAspectIsKept)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-vf setsar=16/11 -c:v libx264 -pix_fmt yuv420p", 2);
    test::copyPlate(folder / "in.mp4", folder / "out.mp4");
    EXPECT_NEAR(openPlate(folder / "in.mp4", {})->info().pixelAspect, 16.0 / 11, 1e-6);
    EXPECT_EQ(probe(folder / "out.mp4", "stream=sample_aspect_ratio"), "16:11");
}

// All quarter turns and mirrors of the display matrix, against ffmpeg's own turning.
TEST(MovieOrientation, PicturesComeUpright)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "flat.mp4", "-c:v libx264 -qp 0 -pix_fmt yuv444p", 3, "64x48");
    for (const int angle : {90, 180, 270}) {
        test::run(fmt::format("ffmpeg -v error -y -i '{}' -c copy -metadata:s:v rotate={} '{}'", folder / "flat.mp4",
                              angle, folder / "turned.mp4"));
        const auto reader = openPlate(folder / "turned.mp4", {});
        EXPECT_EQ(reader->info().width, angle == 180 ? 64 : 48);
        EXPECT_EQ(reader->info().height, angle == 180 ? 48 : 64);
        WriteOptions options;
        options.codec = "ffv1";
        test::copyPlate(folder / "turned.mp4", folder / "ours.mkv", options);
        test::run(
            fmt::format("ffmpeg -v error -y -i '{}' -c:v ffv1 '{}'", folder / "turned.mp4", folder / "theirs.mkv"));
        EXPECT_EQ(test::frameHashes(folder / "ours.mkv"), test::frameHashes(folder / "theirs.mkv")) << angle;
    }
}

// ---- what goes out

TEST(MovieOut, OneFrameMakesAMovieThatPlays)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-f lavfi -i sine=440 -t 2 -c:v libx264 -pix_fmt yuv420p -c:a aac", 50);
    for (const char* name : {"one.mp4", "one.mkv", "one.mov", "one.webm", "one.avi"}) {
        test::copyPlate(folder / "in.mp4", folder / name, {}, {}, {20});
        EXPECT_EQ(test::frameHashes(folder / name).size(), 1u) << name;
    }
}

TEST(MovieOut, NothingIsLeftUnderTheNameUnlessItIsWhole)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mp4", "-c:v libx264 -pix_fmt yuv420p", 10);
    {
        const auto reader = openPlate(folder / "in.mp4", {});
        const auto writer = createPlateWriter(folder / "out.mp4", *reader, {});
        for (FrameNumber n = 0; n < 5; ++n) {
            auto frame = reader->read(n);
            writer->write({n, std::move(frame->pixels), {}, frame->extras});
        }
        EXPECT_FALSE(fs::exists(folder / "out.mp4"));
        EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 2) << "the temporary file is there";
    }
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

TEST(MovieOut, EncodersFollowThePlateAndTheContainer)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "h264.mp4", "-c:v libx264 -pix_fmt yuv420p10le", 2);
    test::makeMovie(folder / "prores.mov", "-c:v prores_ks -profile:v 1", 2);
    test::makeMovie(folder / "ffv1.mkv", "-c:v ffv1 -pix_fmt yuv422p", 2);
    const struct {
        const char *in, *out, *codec;
    } cases[] = {{"h264.mp4", "a.mp4", "h264\nyuv420p10le"},     {"h264.mp4", "a.mkv", "h264\nyuv420p10le"},
                 {"prores.mov", "b.mov", "prores\nyuv422p10le"}, {"prores.mov", "b.mp4", "h264\nyuv422p10le"},
                 {"ffv1.mkv", "c.mkv", "ffv1\nyuv422p"},         {"ffv1.mkv", "c.mp4", "h264\nyuv422p"},
                 {"ffv1.mkv", "c.webm", "vp9\nyuv422p"}};
    for (const auto& c : cases) {
        test::copyPlate(folder / c.in, folder / c.out);
        EXPECT_EQ(probe(folder / c.out, "stream=codec_name,pix_fmt"), c.codec) << c.in << " " << c.out;
    }
    for (const char* codec : {"libx265", "prores_ks", "qtrle", "mjpeg", "libx264rgb", "rawvideo"}) {
        WriteOptions options;
        options.codec = codec;
        test::copyPlate(folder / "ffv1.mkv", folder / "any.mov", options);
        EXPECT_EQ(test::frameHashes(folder / "any.mov").size(), 2u) << codec;
    }
}

TEST(MovieOut, OddSizesAreWritten)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.mkv", "-c:v ffv1 -pix_fmt yuv420p", 3, "63x47", "testsrc");
    for (const char* name : {"out.mp4", "out.mkv", "out.webm", "out.mov"}) {
        test::copyPlate(folder / "in.mkv", folder / name);
        EXPECT_EQ(probe(folder / name, "stream=width,height"), "63\n47") << name;
    }
    EXPECT_EQ(test::frameHashes(folder / "in.mkv"), test::frameHashes(folder / "out.mkv"));
}

TEST(MovieOut, ImagesMakeMovies)
{
    const TemporaryFolder folder;
    for (int i = 1; i <= 5; ++i)
        writeExr(framePath(folder / "a.####.exr", i), test::noise(32, 24, 4, 0, 1, std::uint32_t(i)),
                 {"R", "G", "B", "A"}, true);
    for (const char* name : {"a.mp4", "a.mov", "a.mkv", "a.webm"}) {
        test::copyPlate(folder / "a.####.exr", folder / name);
        EXPECT_EQ(test::frameHashes(folder / name).size(), 5u) << name;
        EXPECT_EQ(probe(folder / name, "stream=r_frame_rate,color_range,color_space,pix_fmt"),
                  "yuv420p\ntv\nbt709\n24/1")
            << name;
    }
    WriteOptions options;
    options.codec = "prores_ks";  // which has alpha
    test::copyPlate(folder / "a.####.exr", folder / "alpha.mov", options);
    EXPECT_TRUE(openPlate(folder / "alpha.mov", {})->info().hasAlpha);
}

// ---- real footage

TEST(MovieFootage, PhoneClipIsTurnedAndKeepsItsTimeAndSound)
{
    const std::string path = test::footage("rain-yard/yard_original.mp4");
    SKIP_WITHOUT_FOOTAGE(path);
    const auto reader = openPlate(path, {});
    const PlateInfo& info = reader->info();
    EXPECT_EQ(info.width, 368);
    EXPECT_EQ(info.height, 640);
    EXPECT_EQ(info.frames.size(), 376u);
    EXPECT_TRUE(info.isVariableRate);
    EXPECT_NEAR(info.fps, 29.74, 0.01);

    // The first frames of the lossless copy that came with it, which was turned by somebody else.
    const auto turned = openPlate(test::footage("rain-yard/yard_000-149.mkv"), {});
    for (const FrameNumber n : {0, 7, 40})
        EXPECT_TRUE(test::sameBits(reader->read(n)->pixels, turned->read(n)->pixels)) << n;

    const TemporaryFolder folder;
    std::vector<FrameNumber> some(60);
    for (FrameNumber n = 0; n < 60; ++n) some[std::size_t(n)] = n;
    test::copyPlate(path, folder / "out.mp4", {}, {}, some);
    const auto before = frameTimes(path), after = frameTimes(folder / "out.mp4");
    ASSERT_EQ(after.size(), 60u);
    for (std::size_t i = 0; i < 60; ++i) EXPECT_NEAR(after[i], before[i], 2e-5);
    EXPECT_EQ(probe(folder / "out.mp4", "stream=width,height"), "368\n640");
}

TEST(MovieFootage, StreetClipsComeThroughWithTheirSound)
{
    const std::string path = test::footage("clean-highway/solidWhiteRight.mp4");
    SKIP_WITHOUT_FOOTAGE(path);
    const TemporaryFolder folder;
    WriteOptions options;
    options.codec = "mpeg4";  // the fastest: the picture is not what this test looks at
    EXPECT_EQ(test::copyPlate(path, folder / "out.mp4", options), 221u);
    EXPECT_EQ(packetHash(path, "a:0"), packetHash(folder / "out.mp4", "a:0"));
    EXPECT_EQ(frameTimes(path), frameTimes(folder / "out.mp4"));
}

// MPEG-4 part 2 has at most 65535 ticks a second, MPEG-2 a few constant rates: the plate's clock is brought to them, or
// the sentence says what to do.
TEST(MovieTime, CodecsWithFewRatesKeepTimeOrSaySo)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "varying.mp4",
                    "-vf settb=1/1000,setpts='N*40+15*mod(N\\,3)' -c:v libx264 -fps_mode vfr -video_track_timescale "
                    "90000 -pix_fmt yuv420p");
    ASSERT_TRUE(openPlate(folder / "varying.mp4", {})->info().isVariableRate);
    WriteOptions mpeg4, mpeg2;
    mpeg4.codec = "mpeg4";
    mpeg2.codec = "mpeg2video";
    const auto expected = frameTimes(folder / "varying.mp4");
    for (const char* name : {"out.mp4", "out.mkv"}) {
        EXPECT_EQ(test::copyPlate(folder / "varying.mp4", folder / name, mpeg4), 12u);
        const auto times = frameTimes(folder / name);
        ASSERT_EQ(times.size(), expected.size());
        for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], 1e-3) << name;
    }
    const auto refusal = [&](const char* plate, const ReadOptions& read) {
        const auto reader = openPlate(folder / plate, read);
        return test::sentenceOf(ErrorCode::InvalidArgument,
                                [&] { createPlateWriter(folder / "no.mkv", *reader, mpeg2); });
    };
    const std::string sentence = refusal("varying.mp4", {});
    EXPECT_SAYS(sentence, "'mpeg2video'");
    EXPECT_SAYS(sentence, "varying");
    EXPECT_SAYS(sentence, "--fps");
    ReadOptions constant, odd;
    constant.fps = 25;
    odd.fps = 17.3;
    EXPECT_SAYS(refusal("varying.mp4", odd), "17.3");
    EXPECT_EQ(test::copyPlate(folder / "varying.mp4", folder / "out2.mkv", mpeg2, constant), 12u);

    // A rate whose fraction has large numbers.
    test::makeMovie(folder / "regular.mkv", "-c:v libx264 -pix_fmt yuv420p", 10, "64x48", "testsrc2", "30000/1001");
    EXPECT_EQ(test::copyPlate(folder / "regular.mkv", folder / "regular2.mkv", mpeg2), 10u);
    EXPECT_EQ(probe(folder / "regular2.mkv", "stream=r_frame_rate"), "30000/1001");
    ReadOptions large;
    large.fps = 29.739541;
    EXPECT_EQ(test::copyPlate(folder / "regular.mkv", folder / "large.mkv", mpeg4, large), 10u);
    const auto times = frameTimes(folder / "large.mkv");
    for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], double(i) / 29.739541, 1e-3);
}

}  // namespace
}  // namespace virga::io
