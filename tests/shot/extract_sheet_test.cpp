#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "shot/ExtractSheet.h"

namespace virga::shot {
namespace {

/// Tiles of a single level each, (n + 1) / count.
matte::StrokeAtlas levels(int count, int width, int height)
{
    matte::StrokeAtlas atlas;
    atlas.width = width;
    atlas.height = height;
    atlas.variants = count;
    atlas.mattes.resize(std::size_t(count));
    atlas.layers = ImageF(width, height * count, 1);
    for (int n = 0; n < count; ++n)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) atlas.layer(n).at(x, y) = float(n + 1) / float(count);
    return atlas;
}

ImageF level(int width, int height, int channels, float value) { return {width, height, channels, value}; }

TEST(ExtractSheet, HasFourPicturesWhereTheyBelong)
{
    const ImageF sheet = extractSheet(level(60, 40, 3, 0.1f), level(60, 40, 1, 0.5f), level(60, 40, 3, 0.2f),
                                      level(60, 40, 3, 0.3f), nullptr);
    ASSERT_EQ(sheet.width(), 2 * 60 + 8);
    ASSERT_EQ(sheet.height(), 2 * 40 + 8);
    ASSERT_EQ(sheet.channels(), 3);
    const auto expectLevel = [&](int left, int top, float value) {
        for (const int x : {left, left + 59})
            for (const int y : {top, top + 39})
                for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(sheet.at(x, y, c), value) << x << ' ' << y;
    };
    expectLevel(0, 0, 0.1f);
    expectLevel(68, 0, 1.0f);
    expectLevel(0, 48, 0.2f);
    expectLevel(68, 48, 0.3f);
    EXPECT_NE(sheet.at(64, 20), 0.1f);
    EXPECT_EQ(sheet.at(64, 20), sheet.at(30, 44));
}

// Reduced by whole steps, each pixel the mean of what it stands for, and grey as RGB.
TEST(ExtractSheet, WidePicturesAreReduced)
{
    for (const auto& [width, height, shown, rows] : {std::array{640, 10, 640, 10}, std::array{641, 10, 320, 5},
                                                     std::array{1920, 1080, 640, 360}, std::array{3000, 1, 600, 1}}) {
        const ImageF sheet = extractSheet(level(width, height, 3, 0.1f), level(width, height, 1, 0.5f),
                                          level(width, height, 1, 0.2f), level(width, height, 3, 0.3f), nullptr);
        EXPECT_EQ(sheet.width(), 2 * shown + 8) << width;
        EXPECT_EQ(sheet.height(), 2 * rows + 8) << width;
        EXPECT_FLOAT_EQ(sheet.at(shown - 1, rows - 1), 0.1f);
        for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(sheet.at(0, rows + 8, c), 0.2f);
    }
    ImageF stripes(1280, 4, 3);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 1280; ++x)
            for (int c = 0; c < 3; ++c) stripes.at(x, y, c) = float(x % 2 + y % 2) + float(c);
    const ImageF sheet =
        extractSheet(stripes, level(1280, 4, 1, 0), level(1280, 4, 3, 0), level(1280, 4, 3, 0), nullptr);
    for (int x = 0; x < 640; ++x)
        for (int c = 0; c < 3; ++c) ASSERT_FLOAT_EQ(sheet.at(x, 1, c), 1.0f + float(c));
}

// The 999th permille is white, what is above it clipped; where there is no rain it is black.
TEST(ExtractSheet, AlphaIsStretched)
{
    ImageF alpha(100, 100, 1);
    for (int n = 0; n < 200; ++n) alpha.data()[n * 50] = 0.05f;
    alpha.data()[25] = 0.9f;
    alpha.data()[75] = 0.02f;
    const ImageF rgb(100, 100, 3);
    const ImageF sheet = extractSheet(rgb, alpha, rgb, rgb, nullptr);
    EXPECT_FLOAT_EQ(sheet.at(108, 0), 1.0f);
    EXPECT_FLOAT_EQ(sheet.at(108 + 25, 0), 1.0f);
    EXPECT_FLOAT_EQ(sheet.at(108 + 75, 0), 0.4f);
    EXPECT_EQ(sheet.at(108 + 1, 0), 0.0f);
    const ImageF none = extractSheet(rgb, ImageF(100, 100, 1), rgb, rgb, nullptr);
    for (int y = 0; y < 100; ++y)
        for (int x = 108; x < 208; ++x) ASSERT_EQ(none.at(x, y), 0.0f);
}

TEST(ExtractSheet, TilesStandSideBySideBelow)
{
    const ImageF rgb(60, 40, 3), alpha(60, 40, 1);
    for (const int count : {1, 7, 8, 20}) {
        const matte::StrokeAtlas atlas = levels(count, 16, 32);
        const ImageF sheet = extractSheet(rgb, alpha, rgb, rgb, &atlas);
        const int columns = std::min(count, (128 + 2) / 18), rows = (count + columns - 1) / columns;
        ASSERT_EQ(sheet.width(), 128);
        ASSERT_EQ(sheet.height(), 88 + 8 + rows * 34) << count;
        for (int n = 0; n < count; ++n) {
            const int left = n % columns * 18, top = 96 + n / columns * 34;
            for (const int x : {0, 15})
                for (const int y : {0, 31})
                    for (int c = 0; c < 3; ++c)
                        EXPECT_EQ(sheet.at(left + x, top + y, c), float(n + 1) / float(count)) << n;
            // The ground shows between tiles as it does between the pictures.
            if (left + 16 < sheet.width()) {
                EXPECT_EQ(sheet.at(left + 16, top), sheet.at(0, 43)) << n;
            }
        }
    }
}

// Tiles that are wider than the pictures, and pictures of one pixel.
TEST(ExtractSheet, HoldsTilesThatAreWiderThanThePictures)
{
    const ImageF dot(1, 1, 3, 0.5f), alpha(1, 1, 1, 0.5f);
    const ImageF alone = extractSheet(dot, alpha, dot, dot, nullptr);
    EXPECT_EQ(alone.width(), 10);
    EXPECT_EQ(alone.height(), 10);
    const matte::StrokeAtlas atlas = levels(3, 64, 256);
    const ImageF sheet = extractSheet(dot, alpha, dot, dot, &atlas);
    EXPECT_GE(sheet.width(), 64);
    EXPECT_EQ(sheet.height(), 10 + 8 + 3 * 258);
    for (int n = 0; n < 3; ++n) EXPECT_EQ(sheet.at(63, 18 + n * 258 + 255), float(n + 1) / 3);
}

}  // namespace
}  // namespace virga::shot
