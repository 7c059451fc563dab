#include "matte/Alternation.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/DrawnRain.h"
#include "matte/TemporalMedian.h"

namespace virga {
namespace {

using matte::alternate;
using matte::Alternation;
using matte::AlternationOptions;
using matte::RainObjective;
using matte::RainTerms;

constexpr double degree = std::numbers::pi / 180.0;

RainTerms bounded(double slant = 0.0)
{
    RainTerms terms;
    terms.color = {0.78f, 0.80f, 0.82f};
    terms.eta = 0.002;
    terms.slant = slant;
    return terms;
}

double largestAlpha(const Alternation& found)
{
    float largest = 0;
    for (const ImageF& alpha : found.alphas)
        for (const float a : alpha.values()) largest = std::max(largest, a);
    return largest;
}

void expectBounded(const Alternation& found, float low, float high)
{
    for (const ImageF& alpha : found.alphas)
        for (const float a : alpha.values()) ASSERT_TRUE(a >= 0.0f && a <= 1.0f) << a;
    for (const float s : found.scene.values()) ASSERT_TRUE(s >= low && s <= high) << s;
    EXPECT_FALSE(found.rose);
}

// Half step by half step, whatever the slant, with bounds and without.
TEST(Alternation, EachHalfStepLowersTheSum)
{
    for (const double slant : {0.0, 7.0, -30.0, 45.0, 80.0}) {
        for (const double tolerance : {1e-7, 1e-4, 0.0}) {  // 0: without bounds
            const bool isBounded = tolerance > 0.0;
            const auto drawn = test::drawRain({.frames = 6, .slant = slant * degree, .noise = 0.01});
            RainTerms terms = bounded(slant * degree);
            terms.bounded = isBounded;
            ImageF scene = matte::temporalMedian(drawn.frames);
            std::vector<ImageF> alphas(6, ImageF(96, 96, 1));
            double sum = rainObjective({drawn.frames}, scene, alphas, terms).total();
            for (int i = 0; i < 5; ++i) {
                solveAlpha({drawn.frames}, scene, terms, alphas, isBounded ? tolerance : 1e-7);
                const double after = rainObjective({drawn.frames}, scene, alphas, terms).total();
                EXPECT_LE(after, sum * (1 + 1e-6)) << slant << " alpha, iteration " << i;
                solveScene({drawn.frames}, alphas, terms, scene, isBounded ? tolerance : 1e-7);
                sum = rainObjective({drawn.frames}, scene, alphas, terms).total();
                EXPECT_LE(sum, after * (1 + 1e-6)) << slant << " scene, iteration " << i;
            }
        }
    }
}

/// F of the header, in double, value by value.
RainObjective plainSum(const matte::Footage& footage, const ImageF& scene, const std::vector<ImageF>& alphas,
                       const RainTerms& terms)
{
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    const auto square = [](double value) { return value * value; };
    const auto right = [&](const ImageF& image, int x, int y, int j) {
        return x + 1 < width ? double(image.at(x + 1, y, j)) - image.at(x, y, j) : 0.0;
    };
    const auto down = [&](const ImageF& image, int x, int y, int j) {
        return y + 1 < height ? double(image.at(x, y + 1, j)) - image.at(x, y, j) : 0.0;
    };
    RainObjective sum;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            for (std::size_t k = 0; k < alphas.size(); ++k) {
                const double a = alphas[k].at(x, y), trust = footage.trust.empty() ? 1.0 : footage.trust[k].at(x, y);
                for (int j = 0; j < channels; ++j)
                    sum.data += trust * square(footage.frames[k].at(x, y, j) - (1 - a) * scene.at(x, y, j) -
                                               a * terms.color[std::size_t(j)]);
                sum.rain += terms.mu * square(std::sin(terms.slant) * right(alphas[k], x, y, 0) +
                                              std::cos(terms.slant) * down(alphas[k], x, y, 0));
                sum.cost += 2 * terms.eta * a * (footage.cost.empty() ? 1.0 : footage.cost[k].at(x, y));
            }
            for (int j = 0; j < channels; ++j)
                sum.scene += terms.lambda * (square(right(scene, x, y, j)) + square(down(scene, x, y, j)));
        }
    return sum;
}

/// Of one channel, the first.
std::vector<ImageF> grey(const std::vector<ImageF>& images)
{
    std::vector<ImageF> grey;
    for (const ImageF& image : images) {
        grey.emplace_back(image.width(), image.height(), 1);
        for (std::size_t i = 0; i < grey.back().size(); ++i)
            grey.back().data()[i] = image.data()[i * std::size_t(image.channels())];
    }
    return grey;
}

// Rows that fill no pack, single rows and columns, one channel and three, with maps and without.
TEST(Alternation, TheSumIsTheHeaders)
{
    struct Size {
        int width, height;
    };
    for (const Size size : {Size{77, 41}, Size{64, 20}, Size{2, 50}, Size{1, 33}, Size{50, 1}, Size{1, 1}})
        for (const bool isColor : {true, false})
            for (const bool hasMaps : {true, false}) {
                auto drawn = test::drawRain(
                    {.width = size.width, .height = size.height, .frames = 3, .strokes = 5, .noise = 0.01});
                if (!isColor) drawn.frames = grey(drawn.frames);
                if (!isColor) drawn.scene = grey({drawn.scene})[0];
                std::vector<ImageF> trust, cost;
                for (const ImageF& alpha : drawn.alphas) {
                    trust.emplace_back(size.width, size.height, 1);
                    cost.emplace_back(size.width, size.height, 1);
                    for (std::size_t i = 0; i < alpha.size(); ++i) {
                        trust.back().data()[i] = float(i % 5) / 4;
                        cost.back().data()[i] = float(i % 7);
                    }
                }
                matte::Footage footage{drawn.frames};
                if (hasMaps) footage = {drawn.frames, trust, cost};
                const RainObjective found = rainObjective(footage, drawn.scene, drawn.alphas, bounded(0.2));
                const RainObjective plain = plainSum(footage, drawn.scene, drawn.alphas, bounded(0.2));
                EXPECT_NEAR(found.data, plain.data, 2e-6 * plain.data) << size.width << " x " << size.height;
                EXPECT_NEAR(found.scene, plain.scene, 2e-6 * plain.scene) << size.width << " x " << size.height;
                EXPECT_NEAR(found.rain, plain.rain, 2e-6 * plain.rain) << size.width << " x " << size.height;
                EXPECT_NEAR(found.cost, plain.cost, 2e-6 * plain.cost) << size.width << " x " << size.height;
            }
}

// The scene step's gradient of F vanishes, by the plain sum; where a pixel is seen in no frame too. Loose ones are
// near.
TEST(Alternation, TheSceneIsAMinimum)
{
    struct Size {
        int width, height;
    };
    for (const Size size : {Size{27, 11}, Size{3, 9}, Size{1, 13}, Size{14, 1}, Size{1, 1}})
        for (const bool isColor : {true, false}) {
            auto drawn =
                test::drawRain({.width = size.width, .height = size.height, .frames = 3, .strokes = 2, .noise = 0.02});
            if (!isColor) drawn.frames = grey(drawn.frames);
            std::vector<ImageF> trust(3, ImageF(size.width, size.height, 1, 0.7f));
            if (size.width > 3)
                for (ImageF& map : trust) map.at(2, 0) = 0.0f;
            const matte::Footage footage{drawn.frames, trust};
            ImageF scene = matte::temporalMedian(drawn.frames), loose = scene;
            solveScene(footage, drawn.alphas, bounded(), scene, 1e-9);
            solveScene(footage, drawn.alphas, bounded(), loose, 1e-4);
            for (std::size_t i = 0; i < scene.size(); ++i) {
                ASSERT_NEAR(loose.data()[i], scene.data()[i], 1e-3);
                ImageF more = scene, less = scene;
                more.data()[i] += 0.01f;
                less.data()[i] -= 0.01f;
                const double slope = (plainSum(footage, more, drawn.alphas, bounded()).total() -
                                      plainSum(footage, less, drawn.alphas, bounded()).total()) /
                                     (double(more.data()[i]) - less.data()[i]);
                ASSERT_NEAR(slope, 0.0, 2e-6) << size.width << " x " << size.height << " " << i;
            }
        }
}

// Loose tolerances are met in float, tight ones in double; widths and heights that fill no block, and a single column.
TEST(Alternation, LooseAlphasAreNearTheTightOnes)
{
    struct Size {
        int width, height;
    };
    for (const Size size : {Size{77, 41}, Size{30, 61}, Size{3, 50}, Size{1, 33}, Size{50, 1}})
        for (const double slant : {0.0, 4.0, -10.0, 30.0, -45.0, 80.0, 90.0})
            for (const double mu : {0.06, 1.0}) {
                const auto drawn = test::drawRain({.width = size.width,
                                                   .height = size.height,
                                                   .frames = 4,
                                                   .strokes = 5,
                                                   .slant = slant * degree,
                                                   .noise = 0.008});
                RainTerms terms = bounded(slant * degree);
                terms.mu = mu;
                std::vector<ImageF> loose(4, ImageF(size.width, size.height, 1)), tight = loose;
                solveAlpha({drawn.frames}, drawn.scene, terms, loose, 1e-4);
                solveAlpha({drawn.frames}, drawn.scene, terms, tight, 1e-9);
                for (std::size_t k = 0; k < 4; ++k)
                    for (std::size_t i = 0; i < tight[k].size(); ++i)
                        ASSERT_NEAR(loose[k].data()[i], tight[k].data()[i], 1e-3)
                            << size.width << " x " << size.height << " " << slant << " " << mu << " " << i;
            }
}

TEST(Alternation, TurnedFootageGivesTurnedAlphas)
{
    const auto drawn = test::drawRain({.width = 60, .height = 80, .frames = 5, .slant = 10 * degree, .noise = 0.01});
    const auto turn = [](const ImageF& image) {
        ImageF turned(image.height(), image.width(), image.channels());
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x)
                for (int c = 0; c < image.channels(); ++c) turned.at(y, x, c) = image.at(x, y, c);
        return turned;
    };
    std::vector<ImageF> turned;
    for (const ImageF& frame : drawn.frames) turned.push_back(turn(frame));
    const Alternation upright = alternate({drawn.frames}, {.terms = bounded(10 * degree), .iterations = 3});
    const Alternation lying = alternate({turned}, {.terms = bounded(80 * degree), .iterations = 3});
    for (std::size_t k = 0; k < turned.size(); ++k) {
        const ImageF expected = turn(upright.alphas[k]);
        for (std::size_t i = 0; i < expected.size(); ++i)
            ASSERT_NEAR(lying.alphas[k].data()[i], expected.data()[i], 1e-5);
    }
}

TEST(Alternation, FindsDrawnRainAndItsSlant)
{
    for (const double slant : {0.0, -12.0, 60.0}) {
        const auto drawn = test::drawRain({.frames = 12, .strokes = 10, .slant = slant * degree, .noise = 0.005});
        const Alternation found = alternate({drawn.frames}, {.terms = bounded(), .iterations = 8, .findSlant = true});
        EXPECT_NEAR(found.slant / degree, slant, 0.3);
        double square = 0;
        for (std::size_t k = 0; k < drawn.alphas.size(); ++k)
            for (std::size_t i = 0; i < drawn.alphas[k].size(); ++i)
                square += std::pow(found.alphas[k].data()[i] - drawn.alphas[k].data()[i], 2);
        EXPECT_LT(std::sqrt(square / (12.0 * 96 * 96)), 0.02) << slant;
        expectBounded(found, 0.1f, 0.5f);
    }
}

TEST(Alternation, WithoutRainThereIsNoAlpha)
{
    const auto still = test::drawRain({.strokes = 0});
    EXPECT_EQ(largestAlpha(alternate({still.frames}, {.terms = bounded()})), 0.0);
}

TEST(Alternation, ThreadsDoNotShow)
{
    const auto drawn = test::drawRain({.frames = 5, .slant = 0.1, .noise = 0.01});
    for (const double tolerance : {1e-7, 1e-4}) {
        const AlternationOptions options{
            .terms = bounded(), .iterations = 3, .stepTolerance = tolerance, .findSlant = true};
        const Alternation many = alternate({drawn.frames}, options);
        const ThreadLimit one(1);
        const Alternation single = alternate({drawn.frames}, options);
        EXPECT_EQ(many.slant, single.slant);
        for (std::size_t k = 0; k < many.alphas.size(); ++k)
            EXPECT_TRUE(std::ranges::equal(many.alphas[k].values(), single.alphas[k].values()));
        EXPECT_TRUE(std::ranges::equal(many.scene.values(), single.scene.values()));
        EXPECT_EQ(many.history.back().total(), single.history.back().total());
    }
}

// A bright thing that is in one frame only lands in neither the scene nor alpha, and a stroke behind it goes on.
TEST(Alternation, WhatIsNotTrustedExplainsNothing)
{
    auto drawn = test::drawRain({.frames = 8, .strokes = 0});
    std::vector<ImageF> trust(8, ImageF(96, 96, 1, 1.0f));
    for (int y = 20; y < 70; ++y)
        for (int j = 0; j < 3; ++j) {
            float& value = drawn.frames[3].at(40, y, j);
            value += 0.4f * (bounded().color[std::size_t(j)] - value);
        }
    for (int y = 42; y < 48; ++y)
        for (int x = 35; x < 45; ++x) {
            trust[3].at(x, y) = 0.0f;
            for (int j = 0; j < 3; ++j) drawn.frames[3].at(x, y, j) = 3.0f;
        }
    const Alternation found = alternate({drawn.frames, trust}, {.terms = bounded(), .iterations = 10});
    EXPECT_FALSE(found.rose);
    for (std::size_t i = 0; i < found.scene.size(); ++i)
        ASSERT_NEAR(found.scene.data()[i], drawn.scene.data()[i], 0.01);
    EXPECT_NEAR(found.alphas[3].at(40, 35), 0.4, 0.02);
    EXPECT_GT(found.alphas[3].at(40, 44), 0.3);
    EXPECT_LT(found.alphas[3].at(37, 44), 0.01);

    std::vector<ImageF> few(2, ImageF(96, 96, 1));
    EXPECT_THROW(alternate({drawn.frames, few}, {}), Error);
}

// A cost of q with eta is one of 1 with q eta, in the steps and in the sum; and where it is high no rain is found.
TEST(Alternation, CostMultipliesEtaPixelByPixel)
{
    const auto drawn = test::drawRain({.frames = 6, .slant = 0.1, .noise = 0.01});
    const std::vector<ImageF> threefold(6, ImageF(96, 96, 1, 3.0f));
    for (const bool isBounded : {true, false}) {
        RainTerms terms = bounded(0.1);
        terms.bounded = isBounded;
        std::vector<ImageF> some(6, ImageF(96, 96, 1)), same = some;
        solveAlpha({.frames = drawn.frames, .cost = threefold}, drawn.scene, terms, some);
        const double sum = rainObjective({.frames = drawn.frames, .cost = threefold}, drawn.scene, some, terms).cost;
        terms.eta *= 3;
        solveAlpha({drawn.frames}, drawn.scene, terms, same);
        EXPECT_NEAR(sum, rainObjective({drawn.frames}, drawn.scene, same, terms).cost, 1e-6 * std::abs(sum));
        for (std::size_t k = 0; k < 6; ++k)
            for (std::size_t i = 0; i < same[k].size(); ++i)
                ASSERT_NEAR(some[k].data()[i], same[k].data()[i], 1e-5) << isBounded;
    }

    std::vector<ImageF> left(6, ImageF(96, 96, 1, 1.0f));
    for (ImageF& cost : left)
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 48; ++x) cost.at(x, y) = 1000.0f;
    const Alternation found =
        alternate({.frames = drawn.frames, .cost = left}, {.terms = bounded(0.1), .iterations = 3});
    EXPECT_FALSE(found.rose);
    double right = 0;
    for (const ImageF& alpha : found.alphas)
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 96; ++x) {
                right += alpha.at(x, y);
                if (x >= 48) continue;
                ASSERT_EQ(alpha.at(x, y), 0.0f) << x << " " << y;
            }
    EXPECT_GT(right, 100.0);
}

TEST(Alternation, SaysWhichCostItCannotTake)
{
    const std::vector<ImageF> frames(3, ImageF(4, 4, 1));
    const auto refusal = [&](const std::vector<ImageF>& cost) {
        try {
            alternate({.frames = frames, .cost = cost}, {});
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
            return std::string(error.what());
        }
        return std::string("taken");
    };
    EXPECT_EQ(refusal({3, ImageF(4, 4, 1, 2.0f)}), "taken");
    EXPECT_NE(refusal({2, ImageF(4, 4, 1)}).find("cost for each of 3 frames or none; got 2"), std::string::npos);
    EXPECT_NE(refusal({3, ImageF(4, 5, 1)}).find("cost needs the frames' size"), std::string::npos);
    EXPECT_NE(refusal({3, ImageF(4, 4, 1, -1.0f)}).find("it holds -1"), std::string::npos);
    EXPECT_NE(refusal({3, ImageF(4, 4, 1, std::numeric_limits<float>::quiet_NaN())}).find("it holds nan"),
              std::string::npos);
}

// ---------------------------------------------------------------------------------------------------------------------
// The worst inputs end in something bounded.

TEST(AlternationStress, FewFrames)
{
    for (const int frames : {1, 2, 3}) {
        const auto drawn = test::drawRain({.frames = frames, .noise = 0.01});
        expectBounded(alternate({drawn.frames}, {.terms = bounded(), .findSlant = true}), 0.0f, 1.0f);
    }
}

TEST(AlternationStress, ColorsWithoutContrast)
{
    for (const float level : {0.0f, 0.8f, 1.0f, 1e4f}) {
        std::vector<ImageF> frames(4, ImageF(32, 24, 3, level));
        RainTerms terms = bounded();
        terms.color = {0.8f, 0.8f, 0.8f};
        for (const double eta : {0.0, 0.002}) {
            terms.eta = eta;
            const float slack = 1e-4f * (1.0f + level);
            const Alternation found = alternate({frames}, {.terms = terms, .iterations = 5});
            expectBounded(found, level - slack, level + slack);
        }
    }
}

TEST(AlternationStress, ExtremeWeights)
{
    const auto drawn = test::drawRain({.frames = 4, .slant = 0.2, .noise = 0.01});
    for (const double lambda : {0.0, 1e9}) {
        for (const double mu : {0.0, 1e9}) {
            for (const double tolerance : {1e-7, 1e-4}) {
                RainTerms terms = bounded(0.2);
                terms.lambda = lambda;
                terms.mu = mu;
                const Alternation found =
                    alternate({drawn.frames}, {.terms = terms, .iterations = 3, .stepTolerance = tolerance});
                for (const ImageF& alpha : found.alphas)
                    for (const float a : alpha.values()) ASSERT_TRUE(a >= 0.0f && a <= 1.0f) << a;
                for (const float s : found.scene.values()) ASSERT_TRUE(std::isfinite(s) && s > -0.5f && s < 1.5f) << s;
            }
        }
    }
}

TEST(AlternationStress, ThinAndBright)
{
    const auto column = test::drawRain({.width = 1, .height = 40, .frames = 4, .noise = 0.01});
    expectBounded(alternate({column.frames}, {.terms = bounded(), .findSlant = true}), 0.0f, 1.0f);

    auto bright = test::drawRain({.frames = 4});
    for (ImageF& frame : bright.frames)
        for (float& value : frame.values()) value *= 1e4f;
    RainTerms terms = bounded();
    terms.color = {7800, 8000, 8200};
    expectBounded(alternate({bright.frames}, {.terms = terms, .iterations = 5}), 0.0f, 1e4f);
}

TEST(Alternation, SaysWhatItCannotTake)
{
    const auto refusal = [](const std::vector<ImageF>& frames, const AlternationOptions& options) {
        try {
            alternate({frames}, options);
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
            return std::string(error.what());
        }
        return std::string("taken");
    };
    EXPECT_NE(refusal({}, {}).find("at least one frame"), std::string::npos);
    EXPECT_NE(refusal({ImageF(4, 4, 2)}, {}).find("1 or 3 channels"), std::string::npos);
    EXPECT_NE(refusal({ImageF(4, 4, 3), ImageF(4, 5, 3)}, {}).find("number 2 has 4 x 5"), std::string::npos);
    std::vector<ImageF> frames(2, ImageF(4, 4, 1));
    frames[1].at(3, 2) = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(refusal(frames, {}).find("frame number 2 holds nan"), std::string::npos);
    AlternationOptions negative;
    negative.terms.mu = -1;
    EXPECT_NE(refusal({ImageF(4, 4, 1)}, negative).find("not negative"), std::string::npos);
    EXPECT_NE(refusal({ImageF(4, 4, 1)}, {.iterations = 0}).find("at least one iteration"), std::string::npos);
}

}  // namespace
}  // namespace virga
