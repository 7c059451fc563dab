#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/AtlasSheet.h"
#include "matte/CutAtlas.h"
#include "support/Files.h"

namespace virga {
namespace {

// A soft stroke: a Gaussian across, 16 px a half period of beads along, its ends 1.5 px soft.
void draw(ImageF& image, double x0, double y0, double length, double sigma, double alpha, double slant)
{
    const double s = std::sin(slant), c = std::cos(slant);
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            const double dx = x - x0, dy = y - y0, u = dx * c - dy * s, v = dx * s + dy * c;
            const double ends = 1 / (1 + std::exp((std::abs(v) - length / 2) / 0.4));
            image.at(x, y) +=
                float(alpha * std::exp(-u * u / (2 * sigma * sigma)) * ends * (1 + 0.2 * std::cos(v / 5)));
        }
}

std::vector<ImageF> rain(double slant)
{
    std::vector<ImageF> alphas(3, ImageF(260, 200, 1));
    for (int k = 0; k < 3; ++k)
        for (int n = 0; n < 5; ++n)
            draw(alphas[std::size_t(k)], 35 + 44 * n + 7 * k, 90 + 5 * n - 3 * k, 24 + 8 * n, 0.8 + 0.2 * n,
                 0.2 + 0.1 * k, slant);
    return alphas;
}

double sumOf(ConstImageViewF image)
{
    double sum = 0;
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) sum += image.at(x, y);
    return sum;
}

TEST(CutAtlas, ATilePeaksAtOneAndKnowsWhatItWas)
{
    const std::vector<ImageF> alphas = rain(0.15);
    const auto strokes = matte::findRainStrokes(alphas, {.slant = 0.15});
    ASSERT_EQ(strokes.size(), 15u);
    const auto atlas = matte::cutAtlas(alphas, strokes, {.exposure = 0.005f});
    EXPECT_EQ(atlas.count(), 15);
    EXPECT_EQ(atlas.width, 16);
    EXPECT_EQ(atlas.height, 64);
    EXPECT_EQ(atlas.groups, 1);
    for (int n = 0; n < atlas.count(); ++n) {
        const auto tile = atlas.layer(n);
        float peak = 0, edge = 0;
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 16; ++x) {
                peak = std::max(peak, tile.at(x, y));
                if (x == 0 || y == 0 || x == 15 || y == 63) edge = std::max(edge, tile.at(x, y));
            }
        EXPECT_EQ(peak, 1.0f);
        EXPECT_LT(edge, 0.1f);
        EXPECT_EQ(atlas.mattes[std::size_t(n)].exposure, 0.005f);
        EXPECT_GT(atlas.mattes[std::size_t(n)].lengthPixels, 22);
        EXPECT_GT(atlas.mattes[std::size_t(n)].widthPixels, 1.5);
        EXPECT_GT(atlas.mattes[std::size_t(n)].mass, 0);
    }
    // What is written is what is read.
    const ImageF sheet = matte::atlasSheet(atlas);
    const std::string json = matte::atlasJson(atlas);
    const auto back = matte::atlasFromSheet(sheet, json, "cut");
    EXPECT_EQ(back.count(), 15);
    EXPECT_EQ(back.mattes[3].lengthPixels, atlas.mattes[3].lengthPixels);
}

TEST(CutAtlas, MassIsKeptAtEverySize)
{
    for (const double slant : {0.0, 0.15, -0.7}) {
        ImageF alpha(120, 120, 1);
        draw(alpha, 60.3, 59.6, 40, 1.3, 0.5, slant);
        const double mass = sumOf(alpha);
        for (float& value : alpha.values()) value += 0.1f;  // a background, to be removed
        std::vector<ImageF> alphas = {alpha};
        const auto strokes = matte::findRainStrokes(alphas, {.slant = slant});
        ASSERT_EQ(strokes.size(), 1u);
        const auto extent = matte::tileExtent(strokes[0], 3);
        for (const auto& [width, height] :
             {std::pair(16, 64), std::pair(8, 32), std::pair(4, 16), std::pair(32, 100)}) {
            const ImageF tile = matte::cutStroke(alpha, strokes[0], width, height, 3);
            const double texel = extent.across / width * extent.along / height;
            EXPECT_NEAR(sumOf(tile) * texel / mass, 1, 0.01) << slant << ' ' << width;
        }
    }
}

TEST(CutAtlas, ReducedTilesKeepTheirMass)
{
    const std::vector<ImageF> alphas = rain(0.15);
    const auto atlas = matte::cutAtlas(alphas, matte::findRainStrokes(alphas, {.slant = 0.15}), {});
    for (int n = 0; n < atlas.count(); ++n) {
        const double mean = sumOf(atlas.layer(n)) / (16 * 64);
        for (const int level : {1, 2, 4, 8, 16}) {
            double sum = 0;
            for (int j = 0; j < 64 / level; ++j)
                for (int i = 0; i < std::max(1, 16 / level); ++i)
                    sum += matte::boxMean(atlas, n, double(i) * level / 16, double(i + 1) * level / 16,
                                          double(j) * level / 64, double(j + 1) * level / 64);
            EXPECT_NEAR(sum / (64 / level * (16 / level)) / mean, 1, 1e-3);
        }
    }
}

TEST(CutAtlas, ANeighbourDoesNotGetIn)
{
    std::vector<ImageF> alphas(2, ImageF(100, 100, 1));
    for (ImageF& alpha : alphas) draw(alpha, 50, 50, 40, 1.0, 0.5, 0);
    draw(alphas[1], 55, 50, 40, 1.0, 0.5, 0);
    const auto found = matte::findRainStrokes(alphas, {});
    ASSERT_EQ(found.size(), 3u);
    ASSERT_LT(found[1].x, 52);
    const ImageF alone = matte::cutStroke(alphas[0], found[0], 16, 64, 4);
    const ImageF beside = matte::cutStroke(alphas[1], found[1], 16, 64, 4);
    EXPECT_NEAR(sumOf(beside) / sumOf(alone), 1, 0.1);
}

TEST(CutAtlas, TheBestAreTakenAndNoneTwice)
{
    const std::vector<ImageF> alphas = rain(0.15);
    auto strokes = matte::findRainStrokes(alphas, {.slant = 0.15});
    const auto once = matte::bestStrokes(strokes, 64);
    strokes.insert(strokes.end(), once.begin(), once.end());
    EXPECT_EQ(matte::bestStrokes(strokes, 64).size(), once.size());
    const auto few = matte::bestStrokes(strokes, 4);
    ASSERT_EQ(few.size(), 4u);
    for (std::size_t n = 0; n < 4; ++n) EXPECT_EQ(few[n].score, once[n].score);
    // What stands still is not rain.
    const std::vector<ImageF> still(2, alphas[0]);
    EXPECT_TRUE(matte::bestStrokes(matte::findRainStrokes(still, {.slant = 0.15}), 64).empty());
    for (std::size_t n = 1; n < once.size(); ++n) EXPECT_LE(once[n].score, once[n - 1].score);
}

TEST(CutAtlas, SizesAreChosenFromTheStrokes)
{
    const std::vector<ImageF> alphas = rain(0.15);
    const auto atlas =
        matte::cutAtlas(alphas, matte::findRainStrokes(alphas, {.slant = 0.15}), {.width = 0, .height = 0});
    EXPECT_EQ(atlas.width % 4, 0);
    EXPECT_GE(atlas.height, 40);
    EXPECT_LE(atlas.height, 52);
}

TEST(CutAtlas, NoStrokesIsOneSentence)
{
    const std::vector<ImageF> alphas(1, ImageF(50, 50, 1));
    try {
        matte::cutAtlas(alphas, {}, {});
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::Input);
        EXPECT_NE(std::string(error.what()).find("no rain"), std::string::npos);
    }
    EXPECT_THROW(matte::cutAtlas(alphas, {}, {.count = 0}), Error);
    EXPECT_THROW(matte::cutAtlas(alphas, {}, {.acrossWidths = 0}), Error);
    EXPECT_THROW(matte::cutAtlas(alphas, {}, {.width = -1}), Error);
}

TEST(CutAtlas, IsTheAtlasOfTheBest)
{
    const std::vector<ImageF> alphas = rain(0.15);
    const auto strokes = matte::findRainStrokes(alphas, {.slant = 0.15});
    auto best = matte::bestStrokes(strokes, 6);
    const auto cut = matte::cutAtlas(alphas, strokes, {.count = 6});
    const auto same = matte::atlasOf(alphas, best, {.count = 6});
    ASSERT_EQ(same.count(), cut.count());
    EXPECT_TRUE(std::equal(cut.layers.values().begin(), cut.layers.values().end(), same.layers.values().begin()));
    // In the order given, however many.
    std::reverse(best.begin(), best.end());
    const auto reversed = matte::atlasOf(alphas, best, {.count = 2});
    ASSERT_EQ(reversed.count(), 6);
    for (int n = 0; n < 6; ++n) {
        EXPECT_EQ(reversed.mattes[std::size_t(n)].lengthPixels, cut.mattes[std::size_t(5 - n)].lengthPixels);
        EXPECT_EQ(sumOf(reversed.layer(n)), sumOf(cut.layer(5 - n)));
    }
    test::sentenceOf(ErrorCode::Input, [&] { matte::atlasOf(alphas, {}, {}); });
    best[0].frame = 3;
    test::sentenceOf(ErrorCode::Internal, [&] { matte::atlasOf(alphas, best, {}); });
    best[0].frame = -1;
    test::sentenceOf(ErrorCode::Internal, [&] { matte::atlasOf(alphas, best, {}); });
}

// Whole strokes and those that a border cuts: what is kept holds all that a tile asks for.
TEST(CutAtlas, AKeptStrokeMakesTheTileOfItsFrame)
{
    for (const double slant : {0.0, 0.15, -0.8, 1.5}) {
        std::vector<ImageF> alphas(1, ImageF(150, 130, 1));
        draw(alphas[0], 75, 65, 34, 1.2, 0.4, slant);
        draw(alphas[0], 12, 64, 30, 1.0, 0.3, slant);
        draw(alphas[0], 140, 124, 30, 1.0, 0.3, slant);
        const auto strokes = matte::findRainStrokes(alphas, {.slant = slant});
        ASSERT_GE(strokes.size(), 2u) << slant;
        // Grain, so that no value stands for another.
        for (std::size_t i = 0; i < alphas[0].size(); ++i) alphas[0].data()[i] += 0.01f * float(i * 7919 % 13);
        for (const auto& stroke : strokes) {
            for (const double acrossWidths : {1.0, 2.5, 16.0}) {
                const auto kept = matte::keepStroke(alphas[0], stroke, acrossWidths);
                EXPECT_EQ(kept.stroke.frame, 0);
                EXPECT_EQ(kept.stroke.length, stroke.length);
                const ImageF whole = matte::cutStroke(alphas[0], stroke, 16, 64, acrossWidths);
                const ImageF tile = matte::cutStroke(kept.alpha, kept.stroke, 16, 64, acrossWidths);
                float off = 0;
                for (std::size_t i = 0; i < tile.size(); ++i)
                    off = std::max(off, std::abs(tile.data()[i] - whole.data()[i]));
                EXPECT_LT(off, 1e-5f) << slant << ' ' << acrossWidths;
            }
            const auto kept = matte::keepStroke(alphas[0], stroke, 2.5);
            EXPECT_LT(kept.alpha.size(), alphas[0].size() / 2);
        }
    }
    // A picture of one pixel, and a place outside of it.
    const ImageF dot(1, 1, 1, 0.5f);
    matte::RainStroke stroke;
    stroke.x = 40, stroke.y = -30, stroke.length = 10, stroke.width = 2;
    EXPECT_EQ(matte::keepStroke(dot, stroke, 2.5).alpha.size(), 1u);
}

TEST(CutAtlas, ThreadsDoNotShow)
{
    const std::vector<ImageF> alphas = rain(0.15);
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        return matte::cutAtlas(alphas, matte::findRainStrokes(alphas, {.slant = 0.15}), {});
    };
    const auto one = run(1), many = run(0);
    EXPECT_TRUE(std::equal(one.layers.values().begin(), one.layers.values().end(), many.layers.values().begin()));
}

}  // namespace
}  // namespace virga
