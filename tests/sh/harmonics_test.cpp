#include "sh/Harmonics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "sh/Panorama.h"

namespace virga::sh {
namespace {

constexpr double pi = std::numbers::pi;

/// Scattered but fixed directions (a golden spiral).
std::vector<glm::dvec3> directions(int count)
{
    std::vector<glm::dvec3> result;
    for (int i = 0; i < count; ++i) {
        const double y = 1.0 - 2.0 * (i + 0.5) / count;
        const double azimuth = i * pi * (3.0 - std::sqrt(5.0));
        const double s = std::sqrt(1.0 - y * y);
        result.emplace_back(s * std::sin(azimuth), y, -s * std::cos(azimuth));
    }
    return result;
}

Harmonics someHarmonics(int order)
{
    Harmonics h(order);
    for (std::size_t i = 0; i < h.coefficient.size(); ++i) {
        const double x = double(i);
        h.coefficient[i] = {std::sin(1.0 + 7.1 * x), std::cos(3.0 * x), std::sin(5.0 - 2.3 * x)};
    }
    return h;
}

TEST(Panorama, DirectionsAreWhereTheConventionSays)
{
    EXPECT_LT(glm::length(panoramaDirection(50, 25, 100, 50) - glm::dvec3(0, 0, -1)), 1e-15);
    EXPECT_LT(glm::length(panoramaDirection(75, 25, 100, 50) - glm::dvec3(1, 0, 0)), 1e-15);
    EXPECT_LT(glm::length(panoramaDirection(10, 0, 100, 50) - glm::dvec3(0, 1, 0)), 1e-15);
    for (const glm::dvec3& d : directions(100)) {
        const glm::dvec2 place = panoramaPlace(3.0 * d, 512, 256);
        EXPECT_LT(glm::length(panoramaDirection(place.x, place.y, 512, 256) - d), 1e-14);
    }
}

TEST(Harmonics, FirstBandsAreTheTextbooks)
{
    for (const glm::dvec3& d : directions(50)) {
        const auto y = basis(2, d);
        // The textbook's axes are (-z, -x, y).
        const double tx = -d.z, ty = -d.x, tz = d.y;
        EXPECT_NEAR(y[0], std::sqrt(0.25 / pi), 1e-15);
        EXPECT_NEAR(y[1], std::sqrt(0.75 / pi) * ty, 1e-15);
        EXPECT_NEAR(y[2], std::sqrt(0.75 / pi) * tz, 1e-15);
        EXPECT_NEAR(y[3], std::sqrt(0.75 / pi) * tx, 1e-15);
        EXPECT_NEAR(y[4], std::sqrt(3.75 / pi) * tx * ty, 1e-15);
        EXPECT_NEAR(y[6], std::sqrt(5.0 / pi) / 4.0 * (3.0 * tz * tz - 1.0), 2e-15);
        EXPECT_NEAR(y[8], std::sqrt(3.75 / pi) / 2.0 * (tx * tx - ty * ty), 1e-15);
    }
}

// Unsoeld 1927: the squares of a band sum to (2l + 1) / (4 pi) in every direction. Stable far beyond what we use.
TEST(Harmonics, BandsAreTheSameInEveryDirection)
{
    for (const glm::dvec3& d : directions(20)) {
        const auto y = basis(600, d);
        for (const int l : {0, 1, 16, 64, 256, 600}) {
            double sum = 0.0;
            for (int m = -l; m <= l; ++m) sum += y[coefficientIndex(l, m)] * y[coefficientIndex(l, m)];
            EXPECT_NEAR(sum * 4.0 * pi / (2 * l + 1), 1.0, 1e-11) << l;
        }
    }
}

TEST(Harmonics, RowWeightsArePositiveAndExact)
{
    for (const int height : {1, 2, 7, 64, 512}) {
        const auto weight = rowWeights(height);
        for (int power = 0; power < std::min(height, 12); ++power) {
            double sum = 0.0;
            for (int j = 0; j < height; ++j) {
                EXPECT_GT(weight[std::size_t(j)], 0.0);
                sum += weight[std::size_t(j)] * std::pow(std::cos((j + 0.5) * pi / height), power);
            }
            EXPECT_NEAR(sum, power % 2 ? 0.0 : 2.0 / (power + 1), 1e-13) << height << " " << power;
        }
    }
}

// Baking a basis function and projecting it gives that one coefficient: the basis is orthonormal.
TEST(Harmonics, AreOrthonormal)
{
    const int order = 9;
    for (int l = 0; l <= order; ++l) {
        for (int m = -l; m <= l; ++m) {
            Harmonics one(order);
            one.coefficient[coefficientIndex(l, m)] = {1.0, -2.0, 0.5};
            const Harmonics back = projectPanorama(bakePanorama(one, 48, 24), order);
            for (std::size_t i = 0; i < back.coefficient.size(); ++i) {
                const double expected = i == coefficientIndex(l, m) ? 1.0 : 0.0;
                EXPECT_NEAR(back.coefficient[i].r, expected, 3e-7);  // the map is single precision
                EXPECT_NEAR(back.coefficient[i].g, -2.0 * expected, 6e-7);
                EXPECT_NEAR(back.coefficient[i].b, 0.5 * expected, 2e-7);
            }
        }
    }
}

TEST(Harmonics, AConstantMapIsAConstant)
{
    for (const auto& [width, height] : {std::array{512, 256}, std::array{100, 50}, std::array{33, 17}}) {
        const ImageF map(width, height, 3, 0.75f);
        const Harmonics h = projectPanorama(map, 8);
        EXPECT_NEAR(h.coefficient[0].r, 0.75 * std::sqrt(4 * pi), 1e-12);
        for (std::size_t i = 1; i < h.coefficient.size(); ++i) EXPECT_LT(glm::length(h.coefficient[i]), 1e-12) << i;
    }
}

TEST(Harmonics, BandLimitedMapsComeBackAtHighOrder)
{
    const Harmonics h = someHarmonics(100);
    const Harmonics back = projectPanorama(bakePanorama(h, 512, 256), 120);
    for (std::size_t i = 0; i < back.coefficient.size(); ++i) {
        const glm::dvec3 expected = i < h.coefficient.size() ? h.coefficient[i] : glm::dvec3(0.0);
        EXPECT_LT(glm::length(back.coefficient[i] - expected), 1e-5) << i;  // coefficients of size 1, pixels to 150
    }
}

TEST(Harmonics, BakingIsEvaluating)
{
    const Harmonics h = someHarmonics(24);
    const ImageF map = bakePanorama(h, 60, 31);
    for (int y = 0; y < 31; y += 3) {
        for (int x = 0; x < 60; x += 7) {
            const glm::dvec3 expected = evaluate(h, panoramaDirection(x + 0.5, y + 0.5, 60, 31));
            for (int c = 0; c < 3; ++c) EXPECT_NEAR(map.at(x, y, c), expected[c], 1e-5);
        }
    }
}

TEST(Harmonics, ConvolvingMultipliesBands)
{
    Harmonics h = someHarmonics(3);
    const Harmonics before = h;
    convolve(h, {{1.0, 0.5, 0.25, 0.125}, {1.0, 1.0, 1.0, 1.0}, {2.0}});
    EXPECT_EQ(h.coefficient[coefficientIndex(3, -2)].r, 0.125 * before.coefficient[coefficientIndex(3, -2)].r);
    EXPECT_EQ(h.coefficient[coefficientIndex(2, 1)].g, before.coefficient[coefficientIndex(2, 1)].g);
    EXPECT_EQ(h.coefficient[0].b, 2.0 * before.coefficient[0].b);
    EXPECT_EQ(h.coefficient[1].b, 0.0);
}

// Parseval: the energies of the bands sum to the integral of the square.
TEST(Harmonics, BandEnergiesSumToTheMeanSquare)
{
    const Harmonics h = someHarmonics(20);
    double energy = 0.0;
    for (const glm::dvec3& e : bandEnergies(h)) energy += e.r;
    const int width = 128, height = 64;
    const ImageF map = bakePanorama(h, width, height);
    const auto weight = rowWeights(height);
    double integral = 0.0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            integral += weight[std::size_t(y)] * 2 * pi / width * map.at(x, y) * map.at(x, y);
        }
    }
    EXPECT_NEAR(integral / energy, 1.0, 1e-6);
}

TEST(Harmonics, ThreadsDoNotChangeABit)
{
    const ImageF map = bakePanorama(someHarmonics(30), 256, 128);
    const Harmonics all = projectPanorama(map, 30);
    const ThreadLimit one(1);
    EXPECT_EQ(projectPanorama(map, 30).coefficient, all.coefficient);
}

// Written down as formulas, not baked by us: bands 0 to 4 of sample values, 512 x 256, to 1e-6.
TEST(Harmonics, AnAnalyticMapHasItsCoefficients)
{
    const int width = 512, height = 256;
    ImageF map(width, height, 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 d = panoramaDirection(x + 0.5, y + 0.5, width, height);
            const double tx = -d.z, ty = -d.x, tz = d.y;  // the textbook's axes
            map.at(x, y, 0) = float(0.5 + tx * ty);
            map.at(x, y, 1) = float(0.25 * tz + 0.5 * tz * tz);
            map.at(x, y, 2) = float(ty * tz * (7 * tz * tz - 3) + tx * (tx * tx - 3 * ty * ty));
        }
    }
    Harmonics expected(16);
    expected.coefficient[coefficientIndex(0, 0)] = {0.5 * std::sqrt(4 * pi), 0.5 / 3 * std::sqrt(4 * pi), 0};
    expected.coefficient[coefficientIndex(2, -2)].r = 1 / std::sqrt(3.75 / pi);
    expected.coefficient[coefficientIndex(1, 0)].g = 0.25 / std::sqrt(0.75 / pi);
    expected.coefficient[coefficientIndex(2, 0)].g = 0.5 / 3 / (std::sqrt(5 / pi) / 4);
    expected.coefficient[coefficientIndex(4, -1)].b = 4.0 / 3 * std::sqrt(2 * pi / 5);
    expected.coefficient[coefficientIndex(3, 3)].b = 4 * std::sqrt(2 * pi / 35);
    const Harmonics found = projectPanorama(map, 16);
    for (std::size_t i = 0; i < found.coefficient.size(); ++i) {
        EXPECT_LT(glm::length(found.coefficient[i] - expected.coefficient[i]), 1e-6) << i;
    }
}

// Rows that are folded at the quarters of the circle and rows that are not give the same.
TEST(Harmonics, FoldedRowsAreFourierTransforms)
{
    const Harmonics h = someHarmonics(20);
    for (const int width : {120, 122, 121}) {
        const ImageF map = bakePanorama(h, width, 64);
        const Harmonics back = projectPanorama(map, 20);
        for (std::size_t i = 0; i < back.coefficient.size(); ++i) {
            EXPECT_LT(glm::length(back.coefficient[i] - h.coefficient[i]), 2e-6) << width << " " << i;
        }
    }
}

// A pixel that holds its value all over: integrals of Y_lm over the patch, worked out by brute force.
TEST(Harmonics, MeansAreIntegratedOverTheirPixels)
{
    const int width = 12, height = 6, order = 9;
    for (const auto& [px, py] : {std::array{0, 0}, std::array{7, 2}, std::array{11, 5}}) {
        ImageF map(width, height, 3);
        map.at(px, py, 1) = 3.0f;
        const Harmonics h = projectPanorama(map, order, PixelValue::Mean);
        std::vector<double> sum(coefficientCount(order), 0.0);
        const int fine = 200;
        for (int j = 0; j < fine; ++j) {
            const double y = py + (j + 0.5) / fine, t = y / height * pi;
            for (int i = 0; i < fine; ++i) {
                const auto value = basis(order, panoramaDirection(px + (i + 0.5) / fine, y, width, height));
                const double area = 2 * pi / width * pi / height * std::sin(t) / (fine * fine);
                for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += 3 * area * value[k];
            }
        }
        for (std::size_t k = 0; k < sum.size(); ++k) EXPECT_NEAR(h.coefficient[k].g, sum[k], 1e-4) << k;
        // The mean is the solid angle's share.
        const double solidAngle = 2 * pi / width * (std::cos(pi * py / height) - std::cos(pi * (py + 1) / height));
        EXPECT_NEAR(h.coefficient[0].g, 3 * solidAngle / std::sqrt(4 * pi), 1e-14);
    }
}

TEST(Harmonics, AConstantMapOfMeansIsAConstantAtAnyOrder)
{
    for (const auto& [width, height] :
         {std::array{512, 256}, std::array{100, 50}, std::array{33, 17}, std::array{2, 1}, std::array{1, 1}}) {
        for (const int order : {4, 40, 150}) {
            const Harmonics h = projectPanorama(ImageF(width, height, 3, 0.75f), order, PixelValue::Mean);
            EXPECT_NEAR(h.coefficient[0].r, 0.75 * std::sqrt(4 * pi), 1e-12);
            for (std::size_t i = 1; i < h.coefficient.size(); ++i) {
                ASSERT_LT(glm::length(h.coefficient[i]), 1e-12) << width << " " << order << " " << i;
            }
        }
    }
}

// How the two readings of a pixel differ, as Harmonics.h says: at a pole by a light's energy, for smooth maps by the
// blur of patches.
TEST(Harmonics, SamplesAndMeansDifferAsTheHeaderSays)
{
    for (const auto& [row, ratio] : {std::pair{0, 0.8727}, {1, 1.0239}, {100, 1.0}, {255, 0.8727}}) {
        ImageF spark(512, 256, 3);
        spark.at(100, row) = 1.0f;
        const double samples = projectPanorama(spark, 0).coefficient[0].r;
        const double means = projectPanorama(spark, 0, PixelValue::Mean).coefficient[0].r;
        EXPECT_NEAR(samples / means, ratio, 2e-4) << row;
    }
    const double pixel = pi / 256;
    for (const int m : {0, 3, 8, 16}) {
        Harmonics h(16);
        h.coefficient[coefficientIndex(16, m)].r = 1.0;
        const Harmonics back = projectPanorama(bakePanorama(h, 512, 256), 16, PixelValue::Mean);
        const double lost = (1.0 - back.coefficient[coefficientIndex(16, m)].r) / (pixel * pixel * 16 * 17 / 24.0);
        EXPECT_GT(lost, 0.45) << m;
        EXPECT_LT(lost, 1.0) << m;
    }
}

TEST(Harmonics, RefuseWhatAMapCannotHold)
{
    EXPECT_THROW(projectPanorama(ImageF(16, 8, 3), 5), Error);
    EXPECT_THROW(projectPanorama(ImageF(16, 8, 3), -1), Error);
}

}  // namespace
}  // namespace virga::sh
