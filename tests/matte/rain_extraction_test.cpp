// What holds of an extraction whatever the footage, then footage that is as bad as can be.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "core/Parallel.h"
#include "matte/DrawnRain.h"
#include "matte/ExposureGain.h"
#include "matte/Pictures.h"
#include "matte/RainExtraction.h"
#include "matte/RainStrokes.h"
#include "support/Files.h"
#include "support/Scores.h"

namespace virga {
namespace {

using matte::ColorSource;
using matte::Extraction;
using matte::ExtractionOptions;
using matte::extractRain;
using test::changed;
using test::DrawnRain;
using test::drawRain;
using test::rootMeanSquare;
using test::sumOf;

constexpr double degree = std::numbers::pi / 180.0;
constexpr std::array<float, 3> color = {0.78f, 0.80f, 0.82f};

/// Of frames that are kept as they were.
Extraction extracted(std::vector<ImageF> frames, const ExtractionOptions& options = {},
                     std::span<const ImageF> covered = {})
{
    return extractRain(frames, options, {}, covered);
}

DrawnRain someRain(double slant = 0.12, int strokes = 12)
{
    return drawRain({.width = 72, .height = 60, .frames = 9, .strokes = strokes, .slant = slant, .noise = 0.006});
}

void expectBounded(const Extraction& found, std::size_t frames)
{
    ASSERT_EQ(found.alphas.size(), frames);
    EXPECT_EQ(found.gains.size(), frames * std::size_t(found.scene.channels()));
    for (const ImageF& alpha : found.alphas)
        for (const float a : alpha.values()) ASSERT_TRUE(a >= 0.0f && a <= 1.0f) << a;
    for (const float s : found.scene.values()) ASSERT_TRUE(std::isfinite(s));
    for (const float sigma : found.noise.sigma.values()) ASSERT_TRUE(std::isfinite(sigma) && sigma > 0.0f) << sigma;
    for (const double gain : found.gains) ASSERT_TRUE(std::isfinite(gain) && gain > 0.0) << gain;
    for (const float c : found.color) EXPECT_TRUE(std::isfinite(c));
    EXPECT_TRUE(std::isfinite(found.colorError));
    EXPECT_TRUE(std::isfinite(found.brightestWet));
    EXPECT_TRUE(std::isfinite(found.range) && found.range > 0.0);
    EXPECT_LE(std::abs(found.direction.slant), 90 * degree + 1e-6);
    for (const auto& f : found.history) EXPECT_TRUE(std::isfinite(f.total()));
}

// Alphas from what is drawn, C and D0 unknown. Nothing found at all would score 0.067 and 0.
TEST(RainExtraction, FindsTheRain)
{
    const DrawnRain drawn = someRain();
    const Extraction found = extracted(drawn.frames);
    expectBounded(found, 9);
    EXPECT_LT(rootMeanSquare(found.alphas, drawn.alphas), 0.012);
    EXPECT_LT(rootMeanSquare(found.scene, drawn.scene), 0.004);
    EXPECT_GT(test::wetDetection(found.alphas, drawn.alphas).f(), 0.97);
    EXPECT_NEAR(found.direction.slant, 0.12, 0.01);
    EXPECT_GT(found.direction.coherence, 0.6);
    EXPECT_TRUE(found.trust.empty());
}

// Nothing knows what white is.
TEST(RainExtraction, FootageTimesAFactorHasTheSameAlphas)
{
    const DrawnRain drawn = someRain();
    for (const bool isColorKnown : {true, false}) {
        ExtractionOptions options;
        if (isColorKnown) options.color = color;
        const Extraction one = extracted(drawn.frames, options);
        for (const float factor : {1e-3f, 1e4f}) {
            ExtractionOptions scaled = options;
            if (isColorKnown) scaled.color = {factor * color[0], factor * color[1], factor * color[2]};
            const Extraction many =
                extracted(changed(drawn.frames, [&](const ImageF& f) { return test::scaled(f, factor); }), scaled);
            // Which samples are wet enough to say something of C is a choice, which rounding may turn for one of them.
            const double much = isColorKnown ? 1 : 10;
            EXPECT_LT(test::largestDifference(many.alphas, one.alphas), much * 1e-3) << factor;
            EXPECT_LT(test::largestDifference(test::scaled(many.scene, 1 / factor), one.scene), much * 2e-4) << factor;
            EXPECT_NEAR(many.direction.slant, one.direction.slant, 1e-4);
            EXPECT_NEAR(many.color[1] / factor, one.color[1], 4e-3);
            EXPECT_NEAR(many.colorError / factor, one.colorError, 1e-3);
            EXPECT_NEAR(many.brightestWet / factor, one.brightestWet, 1e-3);
            EXPECT_EQ(many.colorSource, one.colorSource);
        }
    }
}

// Mirrored, forward differences and samples of the noise fall elsewhere, which is as if there were other noise: alphas
// differ by less than half of their error. Transposed they do not.
TEST(RainExtraction, MirroredAndTransposedFootageHasSuchAlphas)
{
    const DrawnRain drawn = someRain(0.25);
    ExtractionOptions options;
    options.color = color;
    const Extraction found = extracted(drawn.frames, options);
    const double error = rootMeanSquare(found.alphas, drawn.alphas);
    const Extraction mirror = extracted(changed(drawn.frames, test::mirrored), options);
    EXPECT_LT(rootMeanSquare(changed(mirror.alphas, test::mirrored), found.alphas), 0.5 * error);
    EXPECT_LT(rootMeanSquare(test::mirrored(mirror.scene), found.scene), 0.001);
    EXPECT_NEAR(mirror.direction.slant, -found.direction.slant, 0.1 * degree);
    const Extraction turned = extracted(changed(drawn.frames, test::transposed), options);
    EXPECT_LT(rootMeanSquare(changed(turned.alphas, test::transposed), found.alphas), 0.05 * error);
    EXPECT_LT(rootMeanSquare(test::transposed(turned.scene), found.scene), 0.001);
    EXPECT_NEAR(turned.direction.slant, 90 * degree - found.direction.slant, 0.1 * degree);
}

TEST(RainExtraction, ThreadsDoNotShow)
{
    const DrawnRain drawn = someRain();
    const auto run = [&](int threads) {
        const ThreadLimit limit(threads);
        return extracted(drawn.frames);
    };
    const Extraction one = run(1), many = run(0);
    EXPECT_EQ(test::largestDifference(one.alphas, many.alphas), 0.0);
    EXPECT_EQ(test::largestDifference(one.scene, many.scene), 0.0);
    EXPECT_EQ(one.color, many.color);
    EXPECT_EQ(one.direction.slant, many.direction.slant);
}

// Between the two of a round nothing changes but alphas and scene; from round to round costs and C do.
TEST(RainExtraction, FFallsInEachHalfStep)
{
    for (const double slant : {0.0, 0.2, -0.7, 1.3}) {
        std::vector<ImageF> frames = someRain(slant).frames;
        const Extraction all = extracted(frames);
        EXPECT_FALSE(all.rose) << slant;
        EXPECT_NEAR(all.direction.slant, slant, 1.0 * degree);
        frames.resize(3);
        const Extraction found = extracted(frames);
        EXPECT_FALSE(found.rose) << slant;
        ASSERT_EQ(found.history.size(), 6u) << slant;
        for (std::size_t n = 0; n < 6; n += 2)
            EXPECT_LE(found.history[n + 1].total(), found.history[n].total() * (1 + 1e-6)) << slant << ' ' << n;
    }
}

// Of nine frames the scene is nearly known before any alpha is: a step a round.
TEST(RainExtraction, EndsSoonerWhereTheSceneIsNearlyKnown)
{
    for (const double slant : {0.0, 0.2, -0.7})
        EXPECT_EQ(extracted(someRain(slant).frames).history.size(), 3u) << slant;
}

// Noise alone: its brighter half has a mean of 0.4 sigma, and less than a quarter of that is left, above the scene as
// below. (Above there is more of it, as the scene that is trimmed of rain lies a little low.) Of rain less than a
// twentieth is seen below.
TEST(RainExtraction, WithoutRainThereIsWhatNoiseExplains)
{
    std::vector<std::size_t> all(9);
    for (std::size_t k = 0; k < 9; ++k) all[k] = k;
    ExtractionOptions options;
    options.color = color;
    std::vector<ImageF> dry = someRain(0.12, 0).frames;
    const Extraction none = extractRain(dry, options);
    const double sigma = 0.006 / 0.5 * 9 * 72 * 60;  // of alpha, the contrast being 0.5, over all pixels
    EXPECT_LT(sumOf(none.alphas), 0.1 * sigma);
    EXPECT_LT(sumOf(matte::alphasBelow(dry, all, none)), 0.1 * sigma);
    EXPECT_LT(none.direction.coherence, 0.3);

    std::vector<ImageF> wet = someRain().frames;
    const Extraction found = extractRain(wet, options);
    const std::vector<ImageF> wetBelow = matte::alphasBelow(wet, all, found);
    EXPECT_LT(sumOf(wetBelow), 0.05 * sumOf(found.alphas));
    EXPECT_GT(sumOf(found.alphas), 2 * sigma);
    const std::vector<std::size_t> some = {7, 2};
    const std::vector<ImageF> two = matte::alphasBelow(wet, some, found);
    ASSERT_EQ(two.size(), 2u);
    EXPECT_LT(test::largestDifference(two[0], wetBelow[7]), 1e-6);
    EXPECT_LT(test::largestDifference(two[1], wetBelow[2]), 1e-6);

    EXPECT_EQ(extracted(someRain(0.12, 0).frames).colorSource, ColorSource::Fallback);
}

TEST(RainExtraction, FramesInAnotherOrderHaveTheSameScene)
{
    const DrawnRain drawn = someRain();
    ExtractionOptions options;
    options.color = color;
    std::vector<ImageF> backwards = drawn.frames;
    std::reverse(backwards.begin(), backwards.end());
    const Extraction a = extracted(drawn.frames, options), b = extracted(backwards, options);
    EXPECT_LT(rootMeanSquare(a.scene, b.scene), 1e-4);
    std::vector<ImageF> alphas = b.alphas;
    std::reverse(alphas.begin(), alphas.end());
    EXPECT_LT(rootMeanSquare(a.alphas, alphas), 1e-3);
}

// Gains of 0.95 to 1.05 a frame, each channel its own.
TEST(RainExtraction, BreathingExposureIsTakenOut)
{
    const DrawnRain drawn = someRain();
    ExtractionOptions options;
    options.color = color;
    std::vector<ImageF> steady = drawn.frames, breathing = drawn.frames;
    std::vector<double> gains(9 * 3);
    std::array<double, 3> mean{};
    for (std::size_t n = 0; n < gains.size(); ++n) {
        gains[n] = 1.0 + 0.05 * std::sin(double(n) * 1.7);
        mean[n % 3] += std::log(gains[n]) / 9;
    }
    for (std::size_t k = 0; k < 9; ++k) matte::applyGain(breathing[k], {&gains[3 * k], 3});
    const Extraction one = extractRain(steady, options), other = extractRain(breathing, options);
    for (std::size_t n = 0; n < gains.size(); ++n)
        EXPECT_NEAR(other.gains[n], gains[n] / std::exp(mean[n % 3]), 0.006) << n;
    for (const double gain : one.gains) EXPECT_NEAR(gain, 1.0, 0.006);
    EXPECT_LT(rootMeanSquare(other.alphas, drawn.alphas), 1.1 * rootMeanSquare(one.alphas, drawn.alphas));
    EXPECT_LT(rootMeanSquare(other.scene, drawn.scene), 0.006);
    // The frames have lost it, at the mean exposure of each channel.
    for (std::size_t k = 0; k < 9; ++k)
        for (std::size_t i = 0; i < breathing[k].size(); ++i)
            ASSERT_NEAR(breathing[k].data()[i], steady[k].data()[i] * std::exp(mean[i % 3]), 0.008);
}

/// A dark block of 14 x 20 that walks 5 px a frame, from the left to the right.
void walk(std::vector<ImageF>& frames)
{
    for (std::size_t k = 0; k < frames.size(); ++k)
        for (int y = 20; y < 40; ++y)
            for (int x = 2 + 5 * int(k); x < 16 + 5 * int(k); ++x)
                for (int j = 0; j < 3; ++j) frames[k].at(x, y, j) = 0.02f;
}

TEST(RainExtraction, SomethingDarkThatWalksThroughIsNeitherSceneNorRain)
{
    DrawnRain drawn = drawRain({.width = 72, .height = 60, .frames = 12, .strokes = 5, .slant = 0.1, .noise = 0.006});
    ExtractionOptions options;
    options.color = color;
    const Extraction before = extracted(drawn.frames, options);
    walk(drawn.frames);
    const Extraction found = extracted(drawn.frames, options);
    ASSERT_EQ(found.trust.size(), 12u);
    EXPECT_LT(rootMeanSquare(found.scene, drawn.scene), 1.5 * rootMeanSquare(before.scene, drawn.scene));
    // Where it walked: in no frame more than strokes are; where it is there may be what a stroke brings in.
    double sum = 0, extra = 0, count = 0;
    for (std::size_t k = 0; k < 12; ++k)
        for (int y = 20; y < 40; ++y)
            for (int x = 2; x < 71; ++x, ++count) {
                sum += drawn.alphas[k].at(x, y);
                extra += std::max(0.0f, found.alphas[k].at(x, y) - drawn.alphas[k].at(x, y));
            }
    EXPECT_LT(extra / count, 0.004);
    EXPECT_GT(sum / count, 0.01);
    options.movers = false;
    const Extraction naive = extracted(drawn.frames, options);
    EXPECT_TRUE(naive.trust.empty());
}

// Frame k has no picture in its first 2 k columns: what stands there is no rain and no scene.
TEST(RainExtraction, WhatIsNotCoveredDoesNotCount)
{
    DrawnRain drawn = drawRain({.width = 72, .height = 60, .frames = 9, .strokes = 6, .slant = 0.1, .noise = 0.006});
    std::vector<ImageF> covered;
    for (int k = 0; k < 9; ++k) {
        ImageF& there = covered.emplace_back(72, 60, 1, 1.0f);
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 2 * k; ++x) {
                there.at(x, y) = 0;
                for (int j = 0; j < 3; ++j) drawn.frames[std::size_t(k)].at(x, y, j) = 0;
            }
    }
    ExtractionOptions options;
    options.color = color;
    const Extraction found = extracted(drawn.frames, options, covered);
    expectBounded(found, 9);
    double square = 0, count = 0;
    for (int y = 0; y < 60; ++y)
        for (int x = 10; x < 72; ++x)
            for (int j = 0; j < 3; ++j, ++count)
                square += std::pow(double(found.scene.at(x, y, j)) - drawn.scene.at(x, y, j), 2);
    EXPECT_LT(std::sqrt(square / count), 0.006);
    double extra = 0, pixels = 0;
    for (std::size_t k = 0; k < 9; ++k)
        for (int y = 0; y < 60; ++y)
            for (int x = 0; x < 72; ++x, ++pixels)
                extra += std::max(0.0f, found.alphas[k].at(x, y) - drawn.alphas[k].at(x, y));
    EXPECT_LT(extra / pixels, 0.004);
}

// A texture has contrast for strokes to cross. What the scene owes to its own rain `error` knows nothing of: it makes
// errors 1.6 times of what is said of them, rms, over 36 cases that were looked at.
TEST(RainExtraction, ColorAndDirectionAreFoundOverTexture)
{
    double square = 0, cases = 0;
    for (const double slant : {0.0, 10.0, 40.0, 75.0})
        for (const double noise : {1.0 / 255, 2.0 / 255, 3.0 / 255})
            for (const unsigned seed : {1u, 7u}) {
                const DrawnRain drawn =
                    drawRain({.frames = 16, .slant = slant * degree, .noise = noise, .texture = 0.08, .seed = seed});
                const Extraction found = extracted(drawn.frames);
                EXPECT_EQ(found.colorSource, ColorSource::Strokes) << slant << ' ' << noise << ' ' << seed;
                const double mean = (found.color[0] + found.color[1] + found.color[2]) / 3;
                EXPECT_NEAR(mean, 0.80, 4 * found.colorError) << slant << ' ' << noise << ' ' << seed;
                EXPECT_NEAR(mean, 0.80, 0.02) << slant << ' ' << noise << ' ' << seed;
                EXPECT_LT(found.colorError, 0.05) << slant << ' ' << noise << ' ' << seed;
                EXPECT_GT(mean, found.brightestWet) << slant << ' ' << noise << ' ' << seed;
                EXPECT_NEAR(found.direction.slant / degree, slant, 0.5) << noise << ' ' << seed;
                square += std::pow((mean - 0.80) / found.colorError, 2), ++cases;
            }
    EXPECT_LT(std::sqrt(square / cases), 2.2);
}

// Eq. (1) as it is printed.
TEST(RainExtraction, ThePapersIsTheAlternation)
{
    const DrawnRain drawn = someRain(0.12);
    ExtractionOptions options;
    options.paper = true;
    options.color = color;
    const Extraction found = extracted(drawn.frames, options);
    ASSERT_EQ(found.alphas.size(), 9u);
    EXPECT_EQ(found.terms.lambda, 1.0 / 20);
    EXPECT_EQ(found.terms.mu, 1.0 / 4);
    EXPECT_EQ(found.terms.eta, 0.0);
    EXPECT_FALSE(found.terms.bounded);
    EXPECT_EQ(found.history.size(), 3u);
    EXPECT_FALSE(found.rose);
    for (const double gain : found.gains) EXPECT_EQ(gain, 1.0);
    EXPECT_LT(rootMeanSquare(found.alphas, drawn.alphas), 0.03);
}

TEST(RemoveRain, GivesWhatIsBehind)
{
    const DrawnRain drawn = drawRain({.width = 40, .height = 30, .frames = 1, .strokes = 6});
    ImageF frame = drawn.frames[0];
    const ImageF& alpha = drawn.alphas[0];
    matte::removeRain(frame, alpha, drawn.scene, nullptr, color);
    EXPECT_LT(test::largestDifference(frame, drawn.scene), 3e-7);
    const ImageF everywhere(40, 30, 1, 1.0f), nowhere(40, 30, 1);
    ImageF trusted = drawn.frames[0];
    matte::removeRain(trusted, alpha, drawn.scene, &everywhere, color);
    EXPECT_EQ(test::largestDifference(trusted, frame), 0.0);

    // Something else stands before a scene that is not asked.
    ImageF other = drawn.frames[0];
    matte::removeRain(other, alpha, ImageF(40, 30, 3, 9.0f), &nowhere, color);
    EXPECT_LT(test::largestDifference(other, drawn.scene), 1e-6);
    // Of what is behind an opaque drop nothing is known but the scene.
    ImageF opaque = drawn.frames[0];
    matte::removeRain(opaque, ImageF(40, 30, 1, 1.0f), drawn.scene, &nowhere, color);
    EXPECT_EQ(test::largestDifference(opaque, drawn.scene), 0.0);
}

TEST(RemoveRain, LeavesPixelsWithoutRainBitForBit)
{
    const float awkward[] = {0.0f, -0.0f, -1.5f, 1e30f, 1e-42f, 0.1f, std::numeric_limits<float>::quiet_NaN()};
    ImageF frame(7, 2, 3);
    for (int x = 0; x < 7; ++x)
        for (int y = 0; y < 2; ++y)
            for (int j = 0; j < 3; ++j) frame.at(x, y, j) = awkward[x];
    ImageF alpha(7, 2, 1), trust(7, 2, 1, 1.0f);
    for (int x = 0; x < 7; ++x) trust.at(x, 1) = 0;
    ImageF clean = frame;
    matte::removeRain(clean, alpha, ImageF(7, 2, 3, 0.9f), &trust, color);  // brighter than C: 0 (C - S) is -0
    EXPECT_EQ(std::memcmp(clean.data(), frame.data(), frame.size() * sizeof(float)), 0);
}

TEST(AlphaConfidence, IsTheShareThatTheDataHave)
{
    Extraction extraction;
    extraction.scene = ImageF(4, 1, 3);
    extraction.color = {0.8f, 0.8f, 0.8f};
    extraction.terms.mu = 1e-4;
    for (int j = 0; j < 3; ++j) {
        extraction.scene.at(0, 0, j) = 0.8f;
        extraction.scene.at(1, 0, j) = 0.79f;
        extraction.scene.at(2, 0, j) = 0.6f;
        extraction.scene.at(3, 0, j) = 0.0f;
    }
    const ImageF all = matte::alphaConfidence(extraction, nullptr);
    EXPECT_EQ(all.at(0, 0), 0.0f);
    EXPECT_LT(all.at(1, 0), all.at(2, 0));
    EXPECT_LT(all.at(2, 0), all.at(3, 0));
    EXPECT_GT(all.at(3, 0), 0.999f);
    EXPECT_LT(all.at(3, 0), 1.0f);
    const ImageF half(4, 1, 1, 0.5f), none(4, 1, 1);
    const ImageF less = matte::alphaConfidence(extraction, &half), zero = matte::alphaConfidence(extraction, &none);
    for (int x = 1; x < 4; ++x) {
        EXPECT_LT(less.at(x, 0), all.at(x, 0));
        EXPECT_GT(less.at(x, 0), 0.0f);
    }
    for (int x = 0; x < 4; ++x) EXPECT_EQ(zero.at(x, 0), 0.0f);
    extraction.terms.mu = 0;
    EXPECT_EQ(matte::alphaConfidence(extraction, nullptr).at(0, 0), 0.0f);
    EXPECT_EQ(matte::alphaConfidence(extraction, nullptr).at(1, 0), 1.0f);
}

// Few frames, even ones, shapes that are hardly pictures, values that no display has.
TEST(RainExtraction, EndsBoundedOnTheWorstFootage)
{
    const DrawnRain drawn = someRain();
    std::vector<std::pair<std::string, std::vector<ImageF>>> cases;
    for (const std::size_t count : {1u, 2u, 3u})
        cases.push_back({std::to_string(count) + " frames", {drawn.frames.begin(), drawn.frames.begin() + int(count)}});
    for (const float level : {0.0f, 0.3f, 1.0f, 1e4f, 1e-30f, -0.5f})
        for (const int channels : {1, 3})
            cases.push_back({"all " + std::to_string(level), std::vector<ImageF>(6, ImageF(40, 30, channels, level))});
    {
        ImageF rainColor(40, 30, 3);
        for (std::size_t i = 0; i < rainColor.size(); ++i) rainColor.data()[i] = color[i % 3];
        cases.push_back({"all C", std::vector<ImageF>(6, rainColor)});
    }
    for (const auto& [width, height] : {std::pair(1, 60), std::pair(60, 1), std::pair(1, 1), std::pair(2, 2)})
        for (const int count : {1, 7}) {
            cases.push_back({fmt::format("{} frames of {} x {}", count, width, height),
                             drawRain({.width = width, .height = height, .frames = count, .noise = 0.01}).frames});
        }
    cases.push_back({"HDR", changed(drawn.frames, [](const ImageF& f) { return test::scaled(f, 1e4f); })});
    cases.push_back({"clipped", changed(drawn.frames, [](ImageF f) {
                         for (float& value : f.values()) value = std::min(3 * value, 1.0f);
                         return f;
                     })});
    cases.push_back({"80 degrees", someRain(80 * degree).frames});
    cases.push_back({"level", someRain(90 * degree).frames});
    {
        std::vector<ImageF> spike = drawn.frames;
        spike[4].at(30, 30, 1) = 3e4f;
        cases.push_back({"one very bright pixel", spike});
        std::vector<ImageF> flash = drawn.frames;
        for (float& value : flash[4].values()) value *= 100;
        cases.push_back({"one frame of lightning", flash});
        std::vector<ImageF> cut = drawn.frames;
        std::fill(cut[3].values().begin(), cut[3].values().end(), 0.0f);
        cases.push_back({"one black frame", cut});
    }
    for (const auto& [name, frames] : cases) {
        SCOPED_TRACE(name);
        ExtractionOptions options;
        expectBounded(extracted(frames, options), frames.size());
        options.color = color;
        const Extraction found = extracted(frames, options);
        expectBounded(found, frames.size());
        EXPECT_EQ(found.colorSource, ColorSource::Given);
        const std::vector<std::size_t> first = {0};
        const std::vector<ImageF> below = matte::alphasBelow(frames, first, found);
        for (const float a : below[0].values()) ASSERT_TRUE(a >= 0 && a <= 1) << a;
    }
}

TEST(RainExtraction, EndsBoundedWithTheWorstWeights)
{
    const std::vector<ImageF> frames = someRain().frames;
    for (const double lambda : {0.0, 0.01, 1e9})
        for (const double mu : {0.0, 0.01, 1e9}) {
            SCOPED_TRACE(fmt::format("lambda {} mu {}", lambda, mu));
            ExtractionOptions options;
            options.lambda = lambda;
            options.mu = mu;
            const Extraction found = extracted(frames, options);
            expectBounded(found, frames.size());
            EXPECT_EQ(found.terms.lambda, lambda);
            EXPECT_EQ(found.terms.mu, mu);
        }
    ExtractionOptions options;
    options.rounds = 1;
    for (const double slant : {-90.0, -45.0, 90.0}) {
        options.slant = slant * degree;
        const Extraction found = extracted(frames, options);
        expectBounded(found, frames.size());
        EXPECT_EQ(found.direction.slant, slant * degree);
    }
}

TEST(RainExtraction, FramesWithNothingCoveredEndBounded)
{
    const std::vector<ImageF> frames = someRain().frames;
    std::vector<ImageF> covered(9, ImageF(72, 60, 1, 1.0f));
    std::fill(covered[4].values().begin(), covered[4].values().end(), 0.0f);
    for (ImageF& there : covered)
        for (int y = 0; y < 20; ++y)
            for (int x = 40; x < 72; ++x) there.at(x, y) = 0.0f;  // in no frame
    expectBounded(extracted(frames, {}, covered), 9);
    for (ImageF& there : covered) std::fill(there.values().begin(), there.values().end(), 0.0f);
    expectBounded(extracted(frames, {}, covered), 9);
}

// Round blobs that fall 2 px a frame, 40 in each: they have no direction, fewer than half are found as
// strokes, and fewer than one in twenty is a good one.
TEST(RainExtraction, SnowMakesFewStrokes)
{
    DrawnRain drawn = drawRain({.frames = 12, .strokes = 0, .noise = 0.006});
    std::mt19937 engine(11);
    for (int n = 0; n < 40; ++n) {
        const double x0 = engine() % 96, y0 = engine() % 96, radius = 1.5 + 0.1 * (engine() % 15);
        for (std::size_t k = 0; k < 12; ++k) {
            const double cx = x0 + 0.4 * double(k), cy = std::fmod(y0 + 2.0 * double(k), 96);
            for (int y = std::max(0, int(cy) - 5); y < std::min(96, int(cy) + 6); ++y)
                for (int x = std::max(0, int(cx) - 5); x < std::min(96, int(cx) + 6); ++x) {
                    const double distance = std::hypot(x - cx, y - cy);
                    const auto a = float(0.4 * std::clamp(radius + 0.5 - distance, 0.0, 1.0));
                    for (int j = 0; j < 3; ++j)
                        drawn.frames[k].at(x, y, j) += a * (color[std::size_t(j)] - drawn.frames[k].at(x, y, j));
                }
        }
    }
    const Extraction found = extracted(drawn.frames);
    expectBounded(found, 12);
    EXPECT_LT(found.direction.coherence, 0.2);
    const auto strokes = matte::findRainStrokes(found.alphas, {.slant = found.direction.slant,
                                                               .noise = found.noise.typical / 0.5,
                                                               .noiseAlong = std::sqrt(2 * found.terms.mu) / 0.5});
    int good = 0;
    for (const matte::RainStroke& stroke : strokes) good += stroke.score > 0.3;
    EXPECT_LT(double(strokes.size()), 0.5 * 40 * 12);
    EXPECT_LT(good, 0.05 * 40 * 12);
}

TEST(RainExtraction, WhatIsNotFootageIsOneSentence)
{
    const auto refused = [](std::vector<ImageF> frames) {
        for (const bool paper : {false, true}) {
            ExtractionOptions options;
            options.paper = paper;
            EXPECT_NE(test::sentenceOf(ErrorCode::InvalidArgument, [&] { extracted(frames, options); }), "");
        }
    };
    std::vector<ImageF> frames(4, ImageF(20, 10, 3, 0.4f));
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        std::vector<ImageF> some = frames;
        some[2].at(5, 5, 1) = bad;
        refused(some);
    }
    refused({});
    refused({ImageF(20, 10, 3), ImageF(10, 20, 3)});
    refused({ImageF(20, 10, 2), ImageF(20, 10, 2)});
}

}  // namespace
}  // namespace virga
