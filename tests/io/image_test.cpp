#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include "io/Helpers.h"
#include "io/Plate.h"

namespace virga::io {
namespace {

using test::TemporaryFolder;
namespace fs = std::filesystem;

const std::vector<std::string> rgbaNames = {"R", "G", "B", "A"};

// Every one of the 65536 halves, NaN payloads and infinities too.
TEST(Exr, EveryHalfComesBack)
{
    const TemporaryFolder folder;
    ImageF image(256, 64, 4);
    writeExr(folder / "probe.exr", image, rgbaNames, true);
    const RawImage zero = readRawImage(folder / "probe.exr");
    ASSERT_EQ(zero.pixels.size(), image.size());
    for (std::size_t i = 0; i < image.size(); ++i) {
        // The value that half number i stands for, put together from its bits.
        const int sign = int(i >> 15), exponent = int(i >> 10 & 31), mantissa = int(i & 1023);
        if (exponent == 31)
            image.data()[i] =
                std::bit_cast<float>(std::uint32_t(sign) << 31 | 0x7f800000u | std::uint32_t(mantissa) << 13);
        else
            image.data()[i] =
                float((sign != 0 ? -1.0 : 1.0) *
                      (exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25)));
    }
    writeExr(folder / "a.0001.exr", image, rgbaNames, true);
    EXPECT_TRUE(test::sameBits(readRawImage(folder / "a.0001.exr").pixels, image));

    test::copyPlate(folder / "a.####.exr", folder / "b.####.exr");
    EXPECT_TRUE(test::sameBits(readRawImage(folder / "b.0001.exr").pixels, image));
    const auto reader = openPlate(folder / "b.####.exr", {});
    EXPECT_EQ(reader->info().format, "openexr half");
    EXPECT_EQ(reader->info().bitDepth, 16);
}

TEST(Exr, AnyFloatBitsComeBack)
{
    const TemporaryFolder folder;
    std::mt19937 random(5);
    ImageF image(200, 100, 4);
    for (float& value : image.values()) value = std::bit_cast<float>(std::uint32_t(random()));
    writeExr(folder / "a.0001.exr", image, rgbaNames, false);
    test::copyPlate(folder / "a.####.exr", folder / "b.####.exr");
    EXPECT_TRUE(test::sameBits(readRawImage(folder / "b.0001.exr").pixels, image));
    EXPECT_EQ(openPlate(folder / "b.####.exr", {})->info().format, "openexr float");  // float stays float unasked
}

TEST(Exr, TilesCompressionsAndMipLevelsAreRead)
{
    const TemporaryFolder folder;
    const ImageF image = test::noise(150, 90, 4, -1.0f, 4.0f);
    writeExr(folder / "flat.exr", image, rgbaNames, false);
    for (const char* how :
         {"--tile 64 64", "--compression piz", "--compression zips", "--compression rle", "--compression none"}) {
        test::run(fmt::format("oiiotool '{}' {} -o '{}'", folder / "flat.exr", how, folder / "tiled.exr"));
        test::copyPlate(folder / "tiled.exr", folder / "copy.exr");
        EXPECT_TRUE(test::sameBits(readRawImage(folder / "copy.exr").pixels, image)) << how;
    }
}

// A data window inside, beside and around the display window: the picture is the display window.
TEST(Exr, DataWindowIsPlacedInTheDisplayWindow)
{
    const TemporaryFolder folder;
    const ImageF image = test::noise(40, 30, 4, 0.0f, 1.0f);
    writeExr(folder / "flat.exr", image, rgbaNames, false);
    for (const auto& [x, y] : {std::pair{5, 7}, {-10, -4}, {50, 40}, {-100, 0}}) {
        test::run(fmt::format("oiiotool '{}' --origin {:+d}{:+d} --fullsize 64x48+0+0 -o '{}'", folder / "flat.exr", x,
                              y, folder / "window.exr"));
        const ImageF read = readLinearImage(folder / "window.exr");
        ASSERT_EQ(read.width(), 64);
        ASSERT_EQ(read.height(), 48);
        for (int v = 0; v < 48; ++v)
            for (int u = 0; u < 64; ++u) {
                const bool inside = u >= x && u < x + 40 && v >= y && v < y + 30;
                for (int c = 0; c < 4; ++c) ASSERT_EQ(read.at(u, v, c), inside ? image.at(u - x, v - y, c) : 0.0f);
            }
    }
}

TEST(Exr, LayersStandBesideTheBeauty)
{
    const TemporaryFolder folder;
    writeExr(folder / "plate.0001.exr", test::noise(32, 20, 4, 0, 2), rgbaNames, true);
    const auto reader = openPlate(folder / "plate.####.exr", {});
    WriteOptions options;
    options.layers = true;
    options.half = false;
    const auto writer = createPlateWriter(folder / "out.####.exr", *reader, options);
    RenderedFrame frame;
    frame.number = 1;
    frame.beauty = test::noise(32, 20, 4, 0, 2, 2);
    const ImageF rain = test::noise(32, 20, 4, 0, 2, 3), depth = test::noise(32, 20, 1, 1, 100, 4);
    frame.layers.push_back({"rain", {"R", "G", "B", "A"}, rain, false});
    frame.layers.push_back({"rain", {"Z"}, depth, true});
    const ImageF beauty = frame.beauty;
    writer->write(std::move(frame));
    writer->finish();

    const RawImage read = readRawImage(folder / "out.0001.exr");
    const auto channel = [&](const std::string& name) {
        const auto found = std::find(read.channelNames.begin(), read.channelNames.end(), name);
        EXPECT_NE(found, read.channelNames.end()) << name;
        return int(found - read.channelNames.begin());
    };
    ASSERT_EQ(read.pixels.channels(), 9);
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 32; ++x) {
            for (int c = 0; c < 4; ++c) {
                ASSERT_EQ(read.pixels.at(x, y, channel(rgbaNames[std::size_t(c)])), beauty.at(x, y, c));
                ASSERT_EQ(read.pixels.at(x, y, channel("rain." + rgbaNames[std::size_t(c)])), rain.at(x, y, c));
            }
            ASSERT_EQ(read.pixels.at(x, y, channel("rain.Z")), depth.at(x, y));
        }
}

TEST(Exr, FiniteValuesStayFiniteInHalfAndDataStaysFloat)
{
    const TemporaryFolder folder;
    ImageF image(4, 1, 4, 1.0f);
    image.at(0, 0, 0) = 1e6f;
    image.at(1, 0, 0) = -1e6f;
    image.at(2, 0, 0) = std::numeric_limits<float>::infinity();
    image.at(3, 0, 0) = 65519.0f;  // rounds to 65504
    writeExr(folder / "a.exr", image, rgbaNames, true);
    const ImageF read = readRawImage(folder / "a.exr").pixels;
    EXPECT_EQ(read.at(0, 0, 0), 65504.0f);
    EXPECT_EQ(read.at(1, 0, 0), -65504.0f);
    EXPECT_EQ(read.at(2, 0, 0), std::numeric_limits<float>::infinity());
    EXPECT_EQ(read.at(3, 0, 0), 65504.0f);
}

TEST(Exr, MetadataOfEachFrameIsKept)
{
    const TemporaryFolder folder;
    writeExr(folder / "flat.exr", test::noise(16, 8, 4, 0, 1), rgbaNames, true);
    for (int frame = 1; frame <= 3; ++frame)
        test::run(fmt::format(
            "oiiotool '{}' --attrib shot 'A{}' --attrib:type=float focal {}.5 --attrib:type=timecode "
            "smpte:TimeCode 01:02:03:0{} --attrib:type=rational FramesPerSecond 24000/1001 --compression piz "
            "-o '{}'",
            folder / "flat.exr", frame, 30 + frame, frame, framePath(folder / "in.####.exr", frame)));
    EXPECT_NEAR(openPlate(folder / "in.####.exr", {})->info().fps, 24000.0 / 1001, 1e-9);
    test::copyPlate(folder / "in.####.exr", folder / "out.####.exr");
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string info =
            test::run(fmt::format("oiiotool --info -v '{}'", framePath(folder / "out.####.exr", frame)));
        EXPECT_SAYS(info, fmt::format("shot: \"A{}\"", frame));
        EXPECT_SAYS(info, fmt::format("focal: {}.5", 30 + frame));
        EXPECT_SAYS(info, fmt::format("smpte:TimeCode: 01:02:03:0{}", frame));
        EXPECT_SAYS(info, "FramesPerSecond: 24000/1001");
        EXPECT_SAYS(info, "compression: \"piz\"");
        EXPECT_SAYS(info, "half openexr");
    }
}

TEST(Exr, GreyAndLuminanceAreColours)
{
    const TemporaryFolder folder;
    const ImageF grey = test::noise(9, 7, 1, 0, 1);
    writeExr(folder / "y.exr", grey, {"Y"}, false);
    const ImageF read = readLinearImage(folder / "y.exr");
    for (int c = 0; c < 3; ++c) EXPECT_EQ(read.at(4, 3, c), grey.at(4, 3));
}

// PNG, TIFF, DPX: what is not touched comes back to the code, through linear light and premultiplication.
TEST(Images, IntegersComeBack)
{
    const TemporaryFolder folder;
    const ImageF image = test::noise(64, 48, 4, 0.0f, 1.0f);
    writeExr(folder / "source.exr", image, rgbaNames, false);
    const struct {
        const char *name, *how;
    } cases[] = {{"rgb8.png", "--ch R,G,B -d uint8"}, {"rgb16.png", "--ch R,G,B -d uint16"},
                 {"rgb8.tif", "--ch R,G,B -d uint8"}, {"rgb16.tif", "--ch R,G,B -d uint16"},
                 {"ten.dpx", "--ch R,G,B -d uint10"}, {"grey.png", "--ch R -d uint8"},
                 {"rgb8.bmp", "--ch R,G,B -d uint8"}, {"rgb8.tga", "--ch R,G,B -d uint8"},
                 {"rgb8.ppm", "--ch R,G,B -d uint8"}, {"rgb8.sgi", "--ch R,G,B -d uint8"}};
    for (const auto& c : cases) {
        const std::string in = folder / c.name, out = folder / (std::string("out_") + c.name);
        test::run(fmt::format(
            "oiiotool '{}' --colorconvert linear linear {} --attrib oiio:ColorSpace sRGB -o '{}' 2>/dev/null",
            folder / "source.exr", c.how, in));
        test::copyPlate(in, out);
        const RawImage a = readRawImage(in), b = readRawImage(out);
        EXPECT_EQ(a.bitDepth, b.bitDepth) << c.name;
        EXPECT_EQ(a.pixels.channels(), b.pixels.channels()) << c.name;  // grey stays grey
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x)
                for (int k = 0; k < 3; ++k)
                    ASSERT_EQ(a.pixels.at(x, y, std::min(k, a.pixels.channels() - 1)),
                              b.pixels.at(x, y, std::min(k, b.pixels.channels() - 1)))
                        << c.name;
    }
}

// JPEG and WebP lose something, Radiance's shared exponent up to 1/256 of the largest channel.
TEST(Images, LossyFormatsComeNear)
{
    const TemporaryFolder folder;
    ImageF ramp(64, 48, 3);
    for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 3; ++c) ramp.at(x, y, c) = float(x + y) / 110;
    writePng(folder / "in.png", ramp);
    for (const char* name : {"out.jpg", "out.jpeg", "out.webp", "out.hdr", "out.tiff"}) {
        test::copyPlate(folder / "in.png", folder / name);
        const ImageF read = readLinearImage(folder / name);
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 64; ++x)
                for (int c = 0; c < 3; ++c) ASSERT_NEAR(read.at(x, y, c), ramp.at(x, y, c), 0.03) << name;
    }
}

TEST(Images, StraightAlphaComesBack)
{
    const TemporaryFolder folder;
    for (const int bits : {8, 16}) {
        // Raw bytes through ffmpeg, which does not multiply: straight colours under alpha 1..max.
        const std::string in = folder / fmt::format("in{}.png", bits), out = folder / fmt::format("out{}.png", bits);
        test::run(fmt::format(
            "ffmpeg -v error -y -f lavfi -i \"testsrc2=size=64x48,format={},geq=r='r(X,Y)':g='g(X,Y)':b='b(X,Y)':"
            "a='{}+X*3'\" -frames:v 1 '{}'",
            bits == 8 ? "gbrap" : "gbrap16le", 5, in));
        test::copyPlate(in, out);
        EXPECT_EQ(test::frameHashes(in), test::frameHashes(out)) << bits;
        const auto reader = openPlate(in, {});
        EXPECT_TRUE(reader->info().hasAlpha);
        const auto frame = reader->read(0);
        const float alpha = frame->pixels.at(10, 10, 3);
        EXPECT_NEAR(alpha, bits == 8 ? 35 / 255.0 : 35 / 65535.0, 1e-6);
        for (int c = 0; c < 3; ++c) EXPECT_LE(frame->pixels.at(10, 10, c), alpha);
    }
}

TEST(Images, PngIsLinearisedBySrgb)
{
    const TemporaryFolder folder;
    ImageF image(3, 1, 3);
    const float values[3] = {0.0f, 0.2159f, 1.0f};
    for (int x = 0; x < 3; ++x)
        for (int c = 0; c < 3; ++c) image.at(x, 0, c) = values[x];
    writePng(folder / "a.png", image);
    const RawImage raw = readRawImage(folder / "a.png");
    EXPECT_TRUE(raw.isDisplayReferred);
    EXPECT_EQ(raw.pixels.at(0, 0), 0.0f);
    EXPECT_EQ(raw.pixels.at(1, 0), 128.0f);  // integers are given as they are
    EXPECT_EQ(raw.pixels.at(2, 0), 255.0f);
    EXPECT_NEAR(readLinearImage(folder / "a.png").at(1, 0), 0.2158605f, 1e-6);  // code 128
    EXPECT_NEAR(readLinearImage(folder / "a.png", "raw").at(1, 0), 128 / 255.0f, 1e-6);
}

TEST(Images, DepthIn16BitsIsGivenAsItIs)
{
    const TemporaryFolder folder;
    test::run(
        fmt::format("ffmpeg -v error -y -f lavfi -i \"color=black:size=16x16,format=gray16le,geq=lum='X*1000+Y'\" "
                    "-frames:v 1 '{}'",
                    folder / "depth.png"));
    const RawImage raw = readRawImage(folder / "depth.png");
    EXPECT_EQ(raw.bitDepth, 16);
    EXPECT_FALSE(raw.isFloat);
    EXPECT_EQ(raw.pixels.channels(), 1);
    EXPECT_EQ(raw.pixels.at(7, 3), 7003.0f);
}

TEST(Images, ASequenceCanBecomeAMovieAndBack)
{
    const TemporaryFolder folder;
    test::makeMovie(folder / "in.%04d.png", "-pix_fmt rgb24", 6);
    WriteOptions options;
    options.codec = "ffv1";
    EXPECT_EQ(test::copyPlate(folder / "in.%04d.png", folder / "movie.mkv", options), 6u);
    EXPECT_EQ(test::copyPlate(folder / "movie.mkv", folder / "out.%04d.png"), 6u);
    for (int i = 0; i < 6; ++i)
        EXPECT_EQ(test::frameHashes(framePath(folder / "in.%04d.png", i + 1)),
                  test::frameHashes(framePath(folder / "out.%04d.png", i)));
}

TEST(Images, ReadAheadGivesTheFramesThatWereAskedFor)
{
    const TemporaryFolder folder;
    for (int i = 1; i <= 20; ++i) {
        const ImageF image(8, 8, 4, float(i));
        writeExr(framePath(folder / "a.####.exr", i), image, rgbaNames, true);
    }
    const auto reader = openPlate(folder / "a.####.exr", {});
    reader->schedule({3, 4, 5, 9, 1, 20, 2});
    for (const FrameNumber n : {3, 5, 9, 7, 20, 2, 4, 1}) EXPECT_EQ(reader->read(n)->pixels.at(0, 0), float(n)) << n;
    reader->schedule(reader->info().frames);
    for (const FrameNumber n : reader->info().frames) EXPECT_EQ(reader->read(n)->pixels.at(0, 0), float(n));
    reader->schedule({1, 2, 3});  // and going away while it reads ahead is fine
}

TEST(Images, MissingAndDamagedFramesAreNamedAndSurvived)
{
    const TemporaryFolder folder;
    for (const int i : {1, 2, 4, 5})
        writeExr(framePath(folder / "a.####.exr", i), ImageF(64, 64, 4, float(i)), rgbaNames, true);
    fs::resize_file(folder / "a.0004.exr", fs::file_size(folder / "a.0004.exr") / 2);
    const auto sentence = test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.####.exr", {})->read(3); });
    EXPECT_SAYS(sentence, "frame 3 is missing");
    const auto damaged = test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.####.exr", {})->read(4); });
    EXPECT_SAYS(damaged, "a.0004.exr");

    ReadOptions skip, hold;
    skip.onError = OnError::Skip;
    hold.onError = OnError::Hold;
    EXPECT_FALSE(openPlate(folder / "a.####.exr", skip)->read(4).has_value());
    const auto held = openPlate(folder / "a.####.exr", hold)->read(4);
    EXPECT_EQ(held->pixels.at(0, 0), 2.0f);
    EXPECT_EQ(held->number, 4);
    EXPECT_SAYS(held->repaired, "held from frame 2");
}

TEST(Images, ADamagedFirstFrameIsSurvived)
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a.0001.exr") << "not a picture";
    for (const int i : {2, 3})
        writeExr(framePath(folder / "a.####.exr", i), ImageF(8, 8, 4, float(i)), rgbaNames, true);
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.####.exr", {}); }), "a.0001.exr");
    ReadOptions hold;
    hold.onError = OnError::Hold;
    EXPECT_EQ(openPlate(folder / "a.####.exr", hold)->read(1)->pixels.at(0, 0), 2.0f);  // the first good one after it
}

TEST(Images, AFrameOfAnotherSizeIsRefused)
{
    const TemporaryFolder folder;
    writeExr(folder / "a.0001.exr", ImageF(8, 8, 4), rgbaNames, true);
    writeExr(folder / "a.0002.exr", ImageF(9, 8, 4), rgbaNames, true);
    const auto sentence = test::sentenceOf(ErrorCode::Input, [&] { openPlate(folder / "a.####.exr", {})->read(2); });
    EXPECT_SAYS(sentence, "9x8");
    EXPECT_SAYS(sentence, "8x8");
}

TEST(Images, RealPanoramasAreRead)
{
    const std::string path = test::footage("hdri/city_square_overcast_512_dwaa_original.exr");
    SKIP_WITHOUT_FOOTAGE(path);
    const ImageF read = readLinearImage(path);
    const ImageF twin = readLinearImage(test::footage("hdri/city_square_overcast_512.exr"));
    ASSERT_EQ(read.width(), 512);
    ASSERT_EQ(read.height(), 256);
    for (int y = 0; y < 256; y += 5)
        for (int x = 0; x < 512; x += 5)
            EXPECT_NEAR(std::max(0.0f, read.at(x, y, 1)), twin.at(x, y, 1), 1e-6) << x << " " << y;
}

}  // namespace
}  // namespace virga::io
