#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/Error.h"
#include "matte/AtlasSheet.h"
#include "matte/OscillatingDrops.h"

namespace virga::matte {
namespace {

// The sentence of the Error(Input) that `call` throws; empty if it throws none.
template <class Call>
std::string complaint(Call&& call)
{
    try {
        call();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::Input);
        return error.what();
    }
    return {};
}

TEST(AtlasSheet, WrittenAndReadBackIsTheSame)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(4);
    for (const int columns : {0, 7}) {
        const StrokeAtlas back = atlasFromSheet(atlasSheet(atlas, columns), atlasJson(atlas, columns), "round trip");
        ASSERT_EQ(back.count(), atlas.count());
        EXPECT_EQ(back.groups, atlas.groups);
        EXPECT_EQ(back.firstBeadCycles, atlas.firstBeadCycles);
        EXPECT_EQ(back.acrossDiameters, atlas.acrossDiameters);
        EXPECT_TRUE(std::ranges::equal(back.layers.values(), atlas.layers.values()));
        for (int n = 0; n < atlas.count(); ++n) {
            EXPECT_FLOAT_EQ(back.mattes[n].beadCycles, atlas.mattes[n].beadCycles);
            EXPECT_FLOAT_EQ(back.mattes[n].maxDiameter, atlas.mattes[n].maxDiameter);
            EXPECT_FLOAT_EQ(back.mattes[n].mass, atlas.mattes[n].mass);
        }
    }
}

TEST(AtlasSheet, WithoutTextTilesAre16x64)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(4);
    const StrokeAtlas back = atlasFromSheet(atlasSheet(atlas), std::nullopt, "plain");
    EXPECT_EQ(back.count(), atlas.count());
    EXPECT_EQ(back.groups, 1);
    EXPECT_LT(back.mattes[0].beadCycles, 0);
    EXPECT_TRUE(std::ranges::equal(back.layers.values(), atlas.layers.values()));
    // Every matte is dealt to every drop.
    EXPECT_EQ(strokeLayer(back, 3, 0, 0.9999f), back.count() - 1);
    const std::string sentence = complaint([] { atlasFromSheet(ImageF(40, 64, 1, 1), std::nullopt, "odd.png"); });
    EXPECT_NE(sentence.find("odd.png"), std::string::npos);
    EXPECT_NE(sentence.find("40x64"), std::string::npos);
}

TEST(AtlasSheet, AlphaOrLuminance)
{
    ImageF rgba(16, 64, 4, 0.5f);
    rgba.at(3, 3, 0) = rgba.at(3, 3, 1) = rgba.at(3, 3, 2) = 2;
    StrokeAtlas atlas = atlasFromSheet(rgba, std::nullopt, "alpha is flat");
    EXPECT_EQ(atlas.layer(0).at(3, 3), 1);
    EXPECT_NEAR(atlas.layer(0).at(0, 0), 0.25, 1e-6);
    rgba.at(5, 5, 3) = 1;
    atlas = atlasFromSheet(rgba, std::nullopt, "alpha is a matte");
    EXPECT_EQ(atlas.layer(0).at(5, 5), 1);
    EXPECT_EQ(atlas.layer(0).at(3, 3), 0.5f);
}

TEST(AtlasSheet, EmptyTilesAreLeftOut)
{
    ImageF sheet(48, 64, 1, 0.0f);
    sheet.at(20, 10) = 7;
    sheet.at(2, 2) = -1;
    EXPECT_EQ(atlasFromSheet(sheet, std::nullopt, "two empty").count(), 1);
    EXPECT_NE(complaint([] { atlasFromSheet(ImageF(48, 64, 1, 0), std::nullopt, "e.exr"); }).find("all 3"),
              std::string::npos);
}

TEST(AtlasSheet, SaysWhatIsWrong)
{
    const ImageF sheet(32, 64, 1, 1.0f);
    for (const auto& [text, word] : std::initializer_list<std::pair<const char*, const char*>>{
             {"", "JSON"},
             {"[1]", "JSON"},
             {"{}", "tile_width"},
             {R"({"tile_width": "16"})", "not a number"},
             {R"({"tile_width": 1e300})", "out of range"},
             {R"({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 3})", "do not fit"},
             {R"({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 2, "strokes": [3]})", "strokes"},
             {R"({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 2, "across_diameters": -1})", "across"},
             {R"({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 2, "groups": 2, "first_bead_cycles": 0})",
              "first_bead_cycles"}})
        EXPECT_NE(complaint([&] { atlasFromSheet(sheet, text, "a.exr"); }).find(word), std::string::npos) << text;

    ImageF nan = sheet;
    nan.at(31, 7) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(complaint([&] { atlasFromSheet(nan, std::nullopt, "nan.exr"); }).find("(31, 7)"), std::string::npos);
    EXPECT_NE(complaint([] { atlasFromStrokes({}, "none"); }).find("empty"), std::string::npos);
}

// A stroke's share of its own bounding box is the same in the tile, whatever its size was, and its margins are gone.
TEST(AtlasSheet, SingleStrokesAreTrimmedAndKeepTheirMass)
{
    std::vector<ImageF> pictures;
    std::vector<double> means;
    for (const auto& [w, h] : {std::pair(5, 40), std::pair(16, 90), std::pair(90, 700)}) {
        ImageF& picture = pictures.emplace_back(w + 11, h + 30, 3, 0.0f);
        means.push_back(0);
        for (int x = 0; x < w; ++x) means.back() += std::sqrt(std::sin((x + 0.5) / w * 3.14159265)) / w;
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x)
                for (int c = 0; c < 3; ++c)
                    picture.at(x + 4, y + 20, c) = 3 * std::sqrt(std::sin((x + 0.5f) / float(w) * 3.14159265f));
    }
    const StrokeAtlas atlas = atlasFromStrokes({pictures.begin(), pictures.end()}, "strokes");
    EXPECT_EQ(atlas.width, 64);
    EXPECT_EQ(atlas.height, 256);
    EXPECT_EQ(atlas.mattes[1].lengthPixels, 90);
    EXPECT_EQ(atlas.mattes[1].widthPixels, 16);
    for (int n = 0; n < 3; ++n) EXPECT_NEAR(boxMean(atlas, n, 0, 1, 0, 1), means[n], 0.01) << n;
}

}  // namespace
}  // namespace virga::matte
