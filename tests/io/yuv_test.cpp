#include "io/Yuv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/Parallel.h"
#include "core/PictureRows.h"
#include "io/ColorConversion.h"

namespace virga::io {
namespace {

using Family = PlanarFormat::Family;

struct Planes {
    Planes(const PlanarFormat& f, int w, int h) : format(f)
    {
        picture.width = w;
        picture.height = h;
        for (int p = 0; p < f.planes(); ++p) {
            const bool isChroma = f.family == Family::Yuv && (p == 1 || p == 2);
            const int width = isChroma ? (w + (1 << f.chromaShiftX) - 1) >> f.chromaShiftX : w;
            const int height = isChroma ? (h + (1 << f.chromaShiftY) - 1) >> f.chromaShiftY : h;
            stored[std::size_t(p)].assign(std::size_t(width * height * f.bytesPerSample()), 0);
            picture.planes[std::size_t(p)] = stored[std::size_t(p)].data();
            picture.strides[std::size_t(p)] = width * f.bytesPerSample();
        }
    }
    ConstPlanarPicture constPicture() const
    {
        ConstPlanarPicture result;
        result.width = picture.width;
        result.height = picture.height;
        result.strides = picture.strides;
        for (std::size_t p = 0; p < 4; ++p) result.planes[p] = picture.planes[p];
        return result;
    }
    int at(int plane, std::size_t i) const
    {
        const auto& bytes = stored[std::size_t(plane)];
        return format.bits > 8 ? bytes[2 * i] | bytes[2 * i + 1] << 8 : bytes[i];
    }
    void set(int plane, std::size_t i, int code)
    {
        auto& bytes = stored[std::size_t(plane)];
        if (format.bits > 8) {
            bytes[2 * i] = std::uint8_t(code & 255);
            bytes[2 * i + 1] = std::uint8_t(code >> 8);
        } else {
            bytes[i] = std::uint8_t(code);
        }
    }
    std::size_t samples(int plane) const
    {
        return stored[std::size_t(plane)].size() / std::size_t(format.bytesPerSample());
    }

    PlanarFormat format;
    PlanarPicture picture;
    std::array<std::vector<std::uint8_t>, 4> stored;
};

const struct {
    const char* in;
    const char* out;
} spaces[] = {{"sRGB", "Linear Rec.709"},           {"Rec.709 BT.1886", "Linear Rec.709"},
              {"Rec.709 camera", "Linear Rec.709"}, {"Rec.2020 PQ", "Linear Rec.2020"},
              {"Rec.2020 HLG", "Linear Rec.2020"},  {"raw", "raw"}};

constexpr YuvCoding rec709{0.2126, 0.0722, false}, rec601{0.299, 0.114, false}, rec2020{0.2627, 0.0593, false},
    yCgCo{.isYCgCo = true};

// The law of this floor: what nobody touched comes back, in every format, for any codes at all.
TEST(Yuv, UntouchedCodesComeBackInEveryFormat)
{
    std::mt19937 random(7);
    for (const Family family : {Family::Yuv, Family::Rgb, Family::Grey})
        for (const int bits : {8, 9, 10, 12, 14, 16})
            for (const bool hasAlpha : {false, true})
                for (const auto& [sx, sy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 0}, {2, 2}}) {
                    if (family != Family::Yuv && sx + sy > 0) continue;
                    const PlanarFormat format{family, bits, sx, sy, hasAlpha};
                    Planes in(format, 37, 29), out(format, 37, 29);  // odd: the last chroma sample stands for less
                    for (int p = 0; p < format.planes(); ++p)
                        for (std::size_t i = 0; i < in.samples(p); ++i) in.set(p, i, int(random() % (1u << bits)));
                    // Straight colour under alpha 0 is no colour; that case is tested on its own.
                    if (hasAlpha)
                        for (std::size_t i = 0; i < in.samples(format.planes() - 1); ++i)
                            in.set(format.planes() - 1, i, std::max(1, in.at(format.planes() - 1, i)));
                    for (const YuvCoding& matrix : {rec709, rec601, rec2020, yCgCo})
                        for (const bool fullRange : {false, true})
                            for (const auto& space : spaces) {
                                YuvCoding coding = matrix;
                                coding.fullRange = fullRange;
                                ImageF rgba(37, 29, 4);
                                planarToLinear(format, coding, in.constPicture(),
                                               *makeColorTransform(space.in, space.out), rgba);
                                linearToPlanar(format, coding, rgba, *makeColorTransform(space.out, space.in),
                                               out.picture);
                                ASSERT_EQ(in.stored, out.stored)
                                    << "family " << int(family) << " bits " << bits << " shifts " << sx << sy
                                    << " alpha " << hasAlpha << " full " << fullRange << " " << space.in;
                            }
                }
}

// All 2^24 triples of 8-bit codes.
TEST(Yuv, EveryTripleOf8BitCodesComesBack)
{
    const PlanarFormat format{Family::Yuv, 8, 0, 0, false};
    const auto toLinear = makeColorTransform("sRGB", "Linear Rec.709"),
               toCode = makeColorTransform("Linear Rec.709", "sRGB");
    for (const YuvCoding& coding : {rec709, YuvCoding{0.299, 0.114, true}, yCgCo})
        for (int luma = 0; luma < 256; luma += 8) {
            Planes in(format, 1024, 512), out(format, 1024, 512);
            for (std::size_t i = 0; i < in.samples(0); ++i) {
                in.set(0, i, luma + int(i >> 16));
                in.set(1, i, int(i & 255));
                in.set(2, i, int((i >> 8) & 255));
            }
            ImageF rgba(1024, 512, 4);
            planarToLinear(format, coding, in.constPicture(), *toLinear, rgba);
            linearToPlanar(format, coding, rgba, *toCode, out.picture);
            ASSERT_EQ(in.stored, out.stored) << luma;
        }
}

TEST(Yuv, FollowsTheStandard)
{
    // BT.709, 8 bit limited: white, black, and pure red from table 3 of the recommendation.
    const PlanarFormat format{Family::Yuv, 8, 0, 0, false};
    Planes in(format, 3, 1);
    const int codes[3][3] = {{235, 128, 128}, {16, 128, 128}, {63, 102, 240}};
    for (std::size_t i = 0; i < 3; ++i)
        for (int p = 0; p < 3; ++p) in.set(p, i, codes[i][p]);
    ImageF rgba(3, 1, 4);
    planarToLinear(format, rec709, in.constPicture(), *makeColorTransform("sRGB", "Linear Rec.709"), rgba);
    for (int c = 0; c < 4; ++c) EXPECT_NEAR(rgba.at(0, 0, c), 1.0f, 1e-6);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(rgba.at(1, 0, c), 0.0f, 1e-7);
    EXPECT_NEAR(rgba.at(2, 0, 0), 1.0f, 0.02);
    EXPECT_NEAR(rgba.at(2, 0, 1), 0.0f, 0.002);
    EXPECT_NEAR(rgba.at(2, 0, 2), 0.0f, 0.002);
}

// R'G'B' of full-range codes by ITU-T H.273, equations 47-49: a colour, forwards by hand, is what the planes give.
TEST(Yuv, YCgCoFollowsTheStandard)
{
    const PlanarFormat format{Family::Yuv, 8, 0, 0, false};
    const double red = 0.8, green = 0.3, blue = 0.1;
    const double codes[3] = {255 * (0.5 * green + 0.25 * (red + blue)), 128 + 255 * (0.5 * green - 0.25 * (red + blue)),
                             128 + 255 * 0.5 * (red - blue)};
    Planes in(format, 1, 1);
    for (int p = 0; p < 3; ++p) in.set(p, 0, int(std::lround(codes[p])));
    ImageF rgba(1, 1, 4);
    planarToLinear(format, {.fullRange = true, .isYCgCo = true}, in.constPicture(), *makeColorTransform("raw", "raw"),
                   rgba);
    EXPECT_NEAR(rgba.at(0, 0, 0), red, 1.5 / 255);
    EXPECT_NEAR(rgba.at(0, 0, 1), green, 1.0 / 255);
    EXPECT_NEAR(rgba.at(0, 0, 2), blue, 1.5 / 255);
}

TEST(Yuv, ColourIsMultipliedByAlphaAfterItIsLinear)
{
    const PlanarFormat format{Family::Rgb, 8, 0, 0, true};
    Planes in(format, 2, 1), out(format, 2, 1);
    const int codes[4] = {200, 100, 50, 128};  // G B R A
    for (int p = 0; p < 4; ++p) {
        in.set(p, 0, codes[p]);
        in.set(p, 1, p == 3 ? 0 : codes[p]);
    }
    ImageF rgba(2, 1, 4);
    planarToLinear(format, {0.2126, 0.0722, true}, in.constPicture(), *makeColorTransform("sRGB", "Linear Rec.709"),
                   rgba);
    const float alpha = 128.0f / 255;
    EXPECT_NEAR(rgba.at(0, 0, 1), decodeCurveExact(Curve::Srgb, 200 / 255.0) * alpha, 1e-6);
    EXPECT_NEAR(rgba.at(0, 0, 3), alpha, 1e-7);
    linearToPlanar(format, {0.2126, 0.0722, true}, rgba, *makeColorTransform("Linear Rec.709", "sRGB"), out.picture);
    for (int p = 0; p < 4; ++p) {
        EXPECT_EQ(out.at(p, 0), codes[p]);
        EXPECT_EQ(out.at(p, 1), 0);
    }
}

TEST(Yuv, WhatASampleCannotHoldIsClipped)
{
    const PlanarFormat format{Family::Rgb, 8, 0, 0, false};
    Planes out(format, 4, 1);
    ImageF rgba(4, 1, 4);
    const float values[4] = {1e6f, -5.0f, std::numeric_limits<float>::quiet_NaN(),
                             std::numeric_limits<float>::infinity()};
    for (int x = 0; x < 4; ++x)
        for (int c = 0; c < 3; ++c) rgba.at(x, 0, c) = values[x];
    linearToPlanar(format, {0.2126, 0.0722, true}, rgba, *makeColorTransform("Linear Rec.709", "sRGB"), out.picture);
    for (int p = 0; p < 3; ++p) {
        EXPECT_EQ(out.at(p, 0), 255);
        EXPECT_EQ(out.at(p, 1), 0);
        EXPECT_EQ(out.at(p, 2), 0);
        EXPECT_EQ(out.at(p, 3), 255);
    }
}

TEST(Yuv, SameBitsOnAnyNumberOfThreads)
{
    const PlanarFormat format{Family::Yuv, 10, 1, 1, false};
    Planes in(format, 200, 150);
    std::mt19937 random(3);
    for (int p = 0; p < 3; ++p)
        for (std::size_t i = 0; i < in.samples(p); ++i) in.set(p, i, int(random() % 1024));
    const auto toLinear = makeColorTransform("sRGB", "Linear Rec.709");
    ImageF one(200, 150, 4), two(200, 150, 4);
    {
        const ThreadLimit limit(1);
        planarToLinear(format, rec709, in.constPicture(), *toLinear, one);
    }
    planarToLinear(format, rec709, in.constPicture(), *toLinear, two);
    EXPECT_TRUE(std::equal(one.values().begin(), one.values().end(), two.values().begin()));
}

// A band at a time is what the whole picture is, in every layout, odd sizes and sitings included.
TEST(Yuv, RowsAreThoseOfTheWholePicture)
{
    std::mt19937 random(11);
    const auto toLinear = makeColorTransform("sRGB", "Linear Rec.709"),
               toCode = makeColorTransform("Linear Rec.709", "sRGB");
    for (const Family family : {Family::Yuv, Family::Rgb, Family::Grey})
        for (const int bits : {8, 10, 16})
            for (const auto& [sx, sy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 2}})
                for (const bool isSmooth : {false, true}) {
                    if (family != Family::Yuv && (sx + sy > 0 || isSmooth)) continue;
                    const PlanarFormat format{family, bits, sx, sy, bits == 10};
                    const int width = 37, height = 29;
                    Planes in(format, width, height), whole(format, width, height), pieces(format, width, height);
                    for (int p = 0; p < format.planes(); ++p)
                        for (std::size_t i = 0; i < in.samples(p); ++i) in.set(p, i, int(random() % (1u << bits)));
                    const ChromaFilter filter{{isSmooth, 0}, {isSmooth, 0.5}};
                    ImageF one(width, height, 4), two(width, height, 4);
                    planarToLinear(format, rec709, in.constPicture(), *toLinear, one, filter);
                    linearToPlanar(format, rec709, one, *toCode, whole.picture);
                    for (int first = 0; first < height; first += 4) {
                        const int last = std::min(first + 4, height);
                        const ImageView<float> rows = rowsOf(two.view(), first, last);
                        planarRowsToLinear(format, rec709, in.constPicture(), *toLinear, first, rows, filter);
                        linearRowsToPlanar(format, rec709, rows, *toCode, first, pieces.picture);
                    }
                    ASSERT_TRUE(std::equal(one.values().begin(), one.values().end(), two.values().begin()));
                    ASSERT_EQ(whole.stored, pieces.stored) << int(family) << bits << sx << sy << isSmooth;
                }
}

}  // namespace
}  // namespace virga::io
