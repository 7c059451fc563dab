#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/OscillatingDrops.h"
#include "matte/StrokeAtlas.h"

namespace virga::matte {
namespace {

double mean(ConstImageViewF tile)
{
    double sum = 0;
    for (int y = 0; y < tile.height(); ++y)
        for (int x = 0; x < tile.width(); ++x) sum += tile.at(x, y);
    return sum / (double(tile.width()) * tile.height());
}

// A drop that does not oscillate leaves sqrt(1 - x^2) across, the share of its diameter that passes over a point, and
// the light that it takes is the area of its disc.
TEST(OscillatingDrops, PlainDropIsACapsule)
{
    OscillatingDropOptions options;
    options.liveliness = 0;
    const StrokeAtlas atlas = makeOscillatingDropAtlas(3, options);
    const int W = atlas.width, L = atlas.height;
    for (int n = 0; n < atlas.count(); ++n) {
        EXPECT_NEAR(atlas.mattes[n].mass, 1, 0.02) << n;
        const double length = atlas.mattes[n].lengthDiameters;
        if (length < 4) continue;
        EXPECT_NEAR(alongMean(atlas, n, 0.4, 0.6), std::numbers::pi / 4, 0.01) << n;
        for (int x = 0; x < W; ++x) {
            double expected = 0;  // the mean over the texel
            for (int k = 0; k < 100; ++k) {
                const double at = ((x + (k + 0.5) / 100) / W * 2 - 1) * atlas.acrossDiameters;
                expected += std::sqrt(std::max(0.0, 1 - at * at)) / 100;
            }
            EXPECT_NEAR(atlas.layer(n).at(x, L / 2), expected, 0.02) << n << " " << x;
        }
        for (int y = 0; y < L; ++y)  // the same from both ends and sides
            for (int x = 0; x < W; ++x) {
                EXPECT_NEAR(atlas.layer(n).at(x, y), atlas.layer(n).at(x, L - 1 - y), 2e-3);
                EXPECT_NEAR(atlas.layer(n).at(x, y), atlas.layer(n).at(W - 1 - x, y), 2e-3);
            }
    }
}

TEST(OscillatingDrops, ManyMattesNoTwoAlike)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(1);
    ASSERT_GE(atlas.count(), 64);
    double closest = 1;
    for (int a = 0; a < atlas.count(); ++a)
        for (int b = 0; b < a; ++b)
            for (const bool mirrored : {false, true}) {
                double difference = 0;
                for (int y = 0; y < atlas.height; ++y)
                    for (int x = 0; x < atlas.width; ++x)
                        difference += std::abs(atlas.layer(a).at(x, y) -
                                               atlas.layer(b).at(mirrored ? atlas.width - 1 - x : x, y));
                closest = std::min(closest, difference / (atlas.width * atlas.height));
            }
    EXPECT_GT(closest, 0.01);  // mean absolute difference of a texel, of a peak of 1
}

TEST(OscillatingDrops, ValuesEndsAndRoom)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(2);
    for (int n = 0; n < atlas.count(); ++n) {
        const ConstImageViewF tile = atlas.layer(n);
        float peak = 0;
        for (int y = 0; y < atlas.height; ++y)
            for (int x = 0; x < atlas.width; ++x) {
                ASSERT_GE(tile.at(x, y), 0);
                peak = std::max(peak, tile.at(x, y));
            }
        EXPECT_EQ(peak, 1);
        for (int y = 0; y < atlas.height; ++y) {  // the tile has room for the drop's wobble
            EXPECT_LT(tile.at(0, y), 0.25f) << n;
            EXPECT_LT(tile.at(atlas.width - 1, y), 0.25f) << n;
        }
        EXPECT_GT(atlas.mattes[n].mass, 0.3f) << n;
        EXPECT_LT(atlas.mattes[n].mass, 1.25f) << n;
    }
}

// The beads of a matte are as many as it says: the profile of a matte with 4 oscillations has its strongest Fourier
// component, of those that mode 2 or 3 or their harmonics could have made, at one of these.
TEST(OscillatingDrops, BeadsFollowTheOscillations)
{
    OscillatingDropOptions options;
    options.height = 256;
    const StrokeAtlas atlas = makeOscillatingDropAtlas(5, options);
    int beaded = 0, found = 0;
    for (int n = 0; n < atlas.count(); ++n) {
        const StrokeMatte& matte = atlas.mattes[n];
        if (n % atlas.variants < atlas.variants / 2 || matte.beadCycles < 3.5f || matte.beadCycles > 12) continue;
        const double end = 1 / matte.lengthDiameters;  // the path without its round ends
        const auto power = [&](double cycles) {
            double re = 0, im = 0, weights = 0;
            for (int y = 0; y < atlas.height; ++y) {
                const double tau = ((y + 0.5) / atlas.height - end / 2) / (1 - end);
                if (tau < 0.05 || tau > 0.95) continue;
                const double window = 1 - std::cos(2 * std::numbers::pi * (tau - 0.05) / 0.9);
                const double angle = 2 * std::numbers::pi * cycles * tau;
                const double value =
                    window * (atlas.alongProfile[std::size_t(n) * atlas.height + y] - alongMean(atlas, n, 0.1, 0.9));
                re += value * std::cos(angle), im += value * std::sin(angle), weights += window;
            }
            return std::hypot(re, im) / weights;
        };
        double best = 0, at = 0;
        for (double cycles = 2.5; cycles < 26; cycles += 0.05)
            if (const double p = power(cycles); p > best) best = p, at = cycles;
        if (best < 0.01) continue;
        ++beaded;
        const double f = matte.beadCycles, third = f * std::sqrt(30.0 / 8.0);
        for (const double harmonic : {f, third, 2 * f, third - f})
            if (std::abs(at - harmonic) < 0.6) {
                ++found;
                break;
            }
    }
    EXPECT_GE(beaded, 8);
    EXPECT_GE(found, beaded - beaded / 10);
}

TEST(OscillatingDrops, SameAtlasOnAnyThreads)
{
    const StrokeAtlas many = makeOscillatingDropAtlas(7);
    const ThreadLimit one(1);
    const StrokeAtlas single = makeOscillatingDropAtlas(7);
    EXPECT_TRUE(std::ranges::equal(many.layers.values(), single.layers.values()));
    const StrokeAtlas other = makeOscillatingDropAtlas(8);
    EXPECT_FALSE(std::ranges::equal(many.layers.values(), other.layers.values()));
}

TEST(OscillatingDrops, NamesTheOptionThatIsOutOfRange)
{
    OscillatingDropOptions options;
    options.liveliness = std::numeric_limits<float>::quiet_NaN();
    try {
        makeOscillatingDropAtlas(1, options);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
        EXPECT_NE(std::string(error.what()).find("liveliness"), std::string::npos);
    }
}

TEST(StrokeAtlas, IntegralsAreExact)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(1);
    const int W = atlas.width, L = atlas.height;
    for (const int n : {0, 17, 95}) {
        const ConstImageViewF tile = atlas.layer(n);
        EXPECT_NEAR(boxMean(atlas, n, 0, 1, 0, 1), mean(tile), 1e-5);
        EXPECT_NEAR(alongMean(atlas, n, 0, 1), mean(tile) * atlas.acrossDiameters, 1e-5);
        for (int y = 0; y < L; y += 9)
            for (int x = 0; x < W; x += 3) {
                const auto texel = [&](int i, int j) {
                    return double(tile.at(std::min(i, W - 1), std::min(j, L - 1)));
                };
                EXPECT_NEAR(boxMean(atlas, n, double(x) / W, double(x + 1) / W, double(y) / L, double(y + 1) / L),
                            tile.at(x, y), 1e-4);
                if (x + 1 < W && y + 1 < L) {  // a box over parts of four texels
                    EXPECT_NEAR(
                        boxMean(atlas, n, (x + 0.25) / W, (x + 1.25) / W, (y + 0.5) / L, (y + 1.5) / L),
                        0.375 * (texel(x, y) + texel(x, y + 1)) + 0.125 * (texel(x + 1, y) + texel(x + 1, y + 1)),
                        1e-4);
                }
            }
        // Beyond the tile there is nothing.
        EXPECT_NEAR(boxMean(atlas, n, -1, 2, -1, 2), mean(tile) / 9, 1e-5);
        EXPECT_EQ(boxMean(atlas, n, 1.5, 2, 0, 1), 0);
    }
}

TEST(StrokeAtlas, LayersAreDealtByOscillationsAndStrength)
{
    const StrokeAtlas atlas = makeOscillatingDropAtlas(1);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(strokeLayer(atlas, 0, 0, 0), 0);
    EXPECT_EQ(strokeLayer(atlas, nan, nan, 0), 0);
    EXPECT_EQ(strokeLayer(atlas, 1e9f, 1, 0.9999f), atlas.count() - 1);
    for (int n = 0; n < atlas.count(); ++n) {
        const float cycles = atlas.firstBeadCycles * std::exp2(float(n / atlas.variants) / atlas.groupsPerOctave);
        EXPECT_EQ(strokeLayer(atlas, cycles, 1, (float(n % atlas.variants) + 0.5f) / float(atlas.variants)), n);
        EXPECT_NEAR(std::log2(atlas.mattes[n].beadCycles / cycles), 0, 0.25);
        EXPECT_LT(atlas.mattes[n].minDiameter, 1.5e-3f);
        EXPECT_GT(atlas.mattes[n].maxDiameter, 1.5e-3f);
    }
    for (float random = 0; random < 1; random += 0.01f) {  // quiet drops wear the quiet mattes
        EXPECT_LT(strokeLayer(atlas, 2, 0, random) % atlas.variants, 2);
        const StrokeMatte& matte = atlas.mattes[strokeLayer(atlas, 2, oscillationStrength(1.1e-3f), random)];
        EXPECT_LE(matte.minDiameter, 1.1e-3f);
        EXPECT_GE(matte.maxDiameter, 1.1e-3f);
    }
}

TEST(StrokeAtlas, StrengthPeaksAtEddyShedding)
{
    EXPECT_EQ(oscillationStrength(0.5e-3f), 0);
    EXPECT_EQ(oscillationStrength(1.5e-3f), 1);
    EXPECT_NEAR(oscillationStrength(4e-3f), 0.5, 1e-6);
}

TEST(StrokeAtlas, RefusesEmptyAndNotFinite)
{
    for (const float bad : {0.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        StrokeAtlas atlas;
        atlas.width = 4, atlas.height = 16, atlas.variants = 1;
        atlas.mattes.resize(1);
        atlas.layers = ImageF(4, 16, 1, bad);
        EXPECT_THROW(finishAtlas(atlas), Error);
        atlas.layers = ImageF(4, 16, 1, 3.0f);
        finishAtlas(atlas);
        EXPECT_EQ(atlas.layer(0).at(0, 0), 1);
    }
}

}  // namespace
}  // namespace virga::matte
