#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/DrawnRain.h"
#include "matte/RainStrokes.h"

namespace virga {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

struct Drawn {
    double x, y, length, width, alpha, slant;
};

// A bar; each pixel the mean of 8 x 8 points. Bars that overlap show the stronger.
void draw(ImageF& image, const Drawn& bar)
{
    const double s = std::sin(bar.slant), c = std::cos(bar.slant);
    const int reach = int(bar.length / 2 + bar.width) + 2;
    for (int y = std::max(0, int(bar.y) - reach); y < std::min(image.height(), int(bar.y) + reach); ++y)
        for (int x = std::max(0, int(bar.x) - reach); x < std::min(image.width(), int(bar.x) + reach); ++x) {
            int inside = 0;
            for (int p = 0; p < 64; ++p) {
                const double dx = x + (p % 8 - 3.5) / 8 - bar.x, dy = y + (p / 8 - 3.5) / 8 - bar.y;
                inside += std::abs(dx * c - dy * s) < bar.width / 2 && std::abs(dx * s + dy * c) < bar.length / 2;
            }
            image.at(x, y) = std::max(image.at(x, y), float(bar.alpha * inside / 64));
        }
}

void addNoise(ImageF& image, double sigma, unsigned seed)
{
    std::mt19937 engine(seed);
    std::normal_distribution<double> normal(0, sigma);
    for (float& value : image.values()) value += float(normal(engine));
}

// Bars on a loose grid, none near another or the border.
std::vector<Drawn> scattered(double slant, unsigned seed)
{
    std::mt19937 engine(seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * double(engine() >> 8) / (1 << 24);
    };
    std::vector<Drawn> bars;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
            bars.push_back({60 + 80.0 * i + uniform(-8, 8), 60 + 80.0 * j + uniform(-8, 8), uniform(16, 44),
                            uniform(1.5, 4), uniform(0.15, 0.5), slant + uniform(-1, 1) * degree});
    return bars;
}

TEST(RainStrokes, KnownOnesAreFoundAndMeasured)
{
    for (const double slant : {0.0, 7.0, -20.0, 45.0, -80.0, 90.0}) {
        for (const double noise : {0.0, 0.02}) {
            SCOPED_TRACE(testing::Message() << slant << " degrees, noise " << noise);
            const std::vector<Drawn> bars = scattered(slant * degree, 3);
            std::vector<ImageF> alphas(1, ImageF(360, 360, 1));
            double mean = 0, weights = 0;
            for (const Drawn& bar : bars) {
                draw(alphas[0], bar);
                mean += std::pow(bar.length, 3) * bar.slant, weights += std::pow(bar.length, 3);
            }
            if (noise > 0) addNoise(alphas[0], noise, 1);
            const auto found = matte::findRainStrokes(alphas, {.slant = slant * degree, .noise = noise});
            ASSERT_EQ(found.size(), bars.size());
            double square = 0;
            for (const Drawn& bar : bars) {
                const auto at = std::find_if(found.begin(), found.end(), [&](const matte::RainStroke& stroke) {
                    return std::hypot(stroke.x - bar.x, stroke.y - bar.y) < 1.0;
                });
                ASSERT_NE(at, found.end()) << bar.x << ' ' << bar.y;
                EXPECT_NEAR(at->length / bar.length, 1, noise > 0 ? 0.08 : 0.05);
                square += std::pow(at->length / bar.length - 1, 2) / double(bars.size());
                // Sampling between pixels widens by half a pixel at most.
                EXPECT_NEAR(at->width, bar.width, 0.5) << bar.width;
                EXPECT_NEAR(at->contrast / bar.alpha, 1, 0.25) << bar.width;
                EXPECT_NEAR(std::remainder(at->slant - bar.slant, std::numbers::pi) / degree, 0, noise > 0 ? 2.0 : 1.0);
                EXPECT_TRUE(at->inside);
                EXPECT_GT(at->score, 0.2);
                EXPECT_LE(at->score, 1.0);
            }
            EXPECT_LT(std::sqrt(square), 0.05);
            const auto statistics = matte::rainStatistics(found, alphas);
            EXPECT_EQ(statistics.count, int(bars.size()));
            EXPECT_NEAR(std::remainder(statistics.slant - mean / weights, std::numbers::pi) / degree, 0, 0.5);
            EXPECT_LT(statistics.slantSpread / degree, 2.0);
            EXPECT_NEAR(statistics.density, 16e6 / (360 * 360), 1e-6);
            RecordProperty("rms_length_" + std::to_string(int(slant)) + (noise > 0 ? "_noise" : ""),
                           std::to_string(std::sqrt(square)));
        }
    }
}

TEST(RainStrokes, ADirectionThatIsAFewDegreesOffIsPutRight)
{
    std::vector<ImageF> alphas(1, ImageF(360, 360, 1));
    for (const Drawn& bar : scattered(12 * degree, 5)) draw(alphas[0], bar);
    const auto found = matte::findRainStrokes(alphas, {.slant = 7 * degree});
    EXPECT_EQ(found.size(), 16u);
    EXPECT_NEAR(matte::rainStatistics(found, alphas).slant / degree, 12, 0.5);
}

// A third of the strokes cross others.
TEST(RainStrokes, DenseRainKeepsItsDirection)
{
    for (const double slant : {0.0, 7.0, -30.0}) {
        const auto drawn = test::drawRain({.frames = 20, .strokes = 20, .slant = slant * degree, .seed = 8});
        const auto found = matte::findRainStrokes(drawn.alphas, {.slant = slant * degree});
        EXPECT_GT(found.size(), 200u);
        EXPECT_NEAR(matte::rainStatistics(found, drawn.alphas).slant / degree, slant, 0.5);
    }
}

TEST(RainStrokes, TouchingOnesAreParted)
{
    const auto count = [](std::initializer_list<Drawn> bars) {
        std::vector<ImageF> alphas(1, ImageF(100, 120, 1));
        for (const Drawn& bar : bars) draw(alphas[0], bar);
        return matte::findRainStrokes(alphas, {}).size();
    };
    EXPECT_EQ(count({{50, 60, 40, 3, 0.4, 0}}), 1u);
    EXPECT_EQ(count({{48, 60, 40, 2, 0.4, 0}, {51.5, 66, 40, 2, 0.3, 0}}), 2u) << "side by side";
    EXPECT_EQ(count({{50, 40, 30, 3, 0.4, 0}, {50, 73, 30, 3, 0.4, 0}}), 2u) << "a gap of 3 px";
    EXPECT_EQ(count({{50, 40, 30, 3, 0.5, 0}, {50, 70, 30, 3, 0.2, 0}}), 2u) << "a jump in brightness";
    EXPECT_EQ(count({{50, 40, 30, 5, 0.4, 0}, {50, 70, 30, 2, 0.4, 0}}), 2u) << "a jump in width";
}

// 6.2 megapixels of noise, white and as a solver leaves it (cut off at 0, smoothed along the rain). None found is odds
// of less than one false stroke in 2 megapixels, at 95 % (3 / n).
TEST(RainStrokes, NoiseAloneHasNone)
{
    for (const bool smooth : {false, true}) {
        int found = 0;
        for (unsigned k = 0; k < 20; ++k) {
            std::vector<ImageF> alphas(1, ImageF(480, 640, 1));
            addNoise(alphas[0], 0.05, k + 10);
            if (smooth) {
                const ImageF white = alphas[0];
                for (int y = 0; y < 640; ++y)
                    for (int x = 0; x < 480; ++x) {
                        float sum = 0;
                        for (int d = -2; d <= 2; ++d) sum += white.at(x, std::clamp(y + d, 0, 639)) / 5;
                        alphas[0].at(x, y) = std::max(sum, 0.0f);
                    }
            }
            const double slant = k % 2 ? 0.2 : 0.0;
            const auto strokes = smooth
                                     ? matte::findRainStrokes(
                                           alphas, {.slant = slant, .noise = 0.05 / std::sqrt(5.0), .noiseAlong = 1.4})
                                     : matte::findRainStrokes(alphas, {.slant = slant, .noise = 0.05});
            found += int(strokes.size());
        }
        EXPECT_EQ(found, 0) << (smooth ? "smoothed" : "white");
    }
}

TEST(RainStrokes, WhatIsNotRainHasNone)
{
    std::vector<ImageF> alphas(3, ImageF(120, 120, 1));
    for (float& value : alphas[0].values()) value = 0.7f;
    for (int y = 40; y < 80; ++y)
        for (int x = 40; x < 80; ++x) alphas[1].at(x, y) = 0.5f;  // a patch, wider than rain
    draw(alphas[2], {60, 60, 4, 4, 0.6, 0});                      // a flake
    EXPECT_TRUE(matte::findRainStrokes(alphas, {}).empty());
    EXPECT_TRUE(matte::findRainStrokes({}, {}).empty());
    EXPECT_EQ(matte::rainStatistics({}, {}).density, 0);
}

TEST(RainStrokes, WorstInputsAreBounded)
{
    std::vector<ImageF> alphas = {ImageF(), ImageF(1, 50, 1, 0.5f), ImageF(50, 1, 1, 0.5f), ImageF(60, 60, 1)};
    draw(alphas[3], {30, 30, 30, 3, 0.5, 0});
    alphas[3].at(5, 5) = std::numeric_limits<float>::quiet_NaN();
    alphas[3].at(50, 5) = std::numeric_limits<float>::infinity();
    EXPECT_EQ(matte::findRainStrokes(alphas, {}).size(), 1u);
    EXPECT_THROW(matte::findRainStrokes(alphas, {.noiseAlong = -1}), Error);
    EXPECT_THROW(matte::findRainStrokes(alphas, {.noise = -1}), Error);
    EXPECT_THROW(matte::findRainStrokes(alphas, {.slant = 3}), Error);
    EXPECT_THROW(matte::findRainStrokes(alphas, {.maxWidth = 0}), Error);
}

TEST(RainStrokes, OneThatTheBorderCutsIsNotInside)
{
    for (const double slant : {0.0, 20.0}) {
        std::vector<ImageF> alphas(1, ImageF(100, 100, 1));
        draw(alphas[0], {50, 8, 40, 3, 0.5, slant * degree});
        const auto found = matte::findRainStrokes(alphas, {.slant = slant * degree});
        ASSERT_EQ(found.size(), 1u);
        EXPECT_FALSE(found[0].inside);
        EXPECT_EQ(found[0].score, 0);
    }
}

TEST(RainStrokes, ANeighbourCostsIsolationAndABendStraightness)
{
    std::vector<ImageF> alphas(3, ImageF(100, 100, 1));
    for (ImageF& alpha : alphas) draw(alpha, {50, 50, 40, 3, 0.5, 0});
    draw(alphas[1], {57, 50, 40, 3, 0.5, 0});
    // Two bars that bend by 12 degrees in the middle.
    alphas[2] = ImageF(100, 100, 1);
    draw(alphas[2], {48, 40, 22, 3, 0.5, 0.2});
    draw(alphas[2], {48, 59, 22, 3, 0.5, -0.2});
    const auto found = matte::findRainStrokes(alphas, {});
    ASSERT_GE(found.size(), 4u);
    EXPECT_GT(found[0].isolation, 0.95);
    EXPECT_LT(found[1].isolation, 0.3);
    EXPECT_GT(found[0].straightness, 0.95);
    EXPECT_LT(found[3].straightness, found[0].straightness - 0.1);
}

TEST(RainStrokes, ThreadsDoNotShow)
{
    std::vector<ImageF> alphas(6, ImageF(360, 360, 1));
    for (unsigned k = 0; k < 6; ++k) {
        for (const Drawn& bar : scattered(0.1, k + 1)) draw(alphas[k], bar);
        addNoise(alphas[k], 0.02, k);
    }
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        return matte::findRainStrokes(alphas, {.slant = 0.1, .noise = 0.02});
    };
    const auto one = run(1), many = run(0);
    ASSERT_EQ(one.size(), many.size());
    for (std::size_t n = 0; n < one.size(); ++n) {
        EXPECT_EQ(one[n].frame, many[n].frame);
        EXPECT_EQ(one[n].x, many[n].x);
        EXPECT_EQ(one[n].length, many[n].length);
        EXPECT_EQ(one[n].score, many[n].score);
    }
}

}  // namespace
}  // namespace virga
