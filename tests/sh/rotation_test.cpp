#include "sh/Rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "core/Parallel.h"

namespace virga::sh {
namespace {

constexpr double pi = std::numbers::pi;

/// By `angle` about an axis, right-handed.
glm::dmat3 turn(double angle, const glm::dvec3& axis)
{
    return glm::mat3_cast(glm::angleAxis(angle, glm::normalize(axis)));
}

/// Coefficients of size 1 that follow no pattern which a rotation would keep.
Harmonics someHarmonics(int order)
{
    Harmonics h(order);
    for (std::size_t i = 0; i < h.coefficient.size(); ++i) {
        const double x = double(i);
        h.coefficient[i] = {std::sin(1.0 + 7.1 * x), std::cos(3.0 * x * x), std::sin(5.0 - 2.3 * x)};
    }
    return h;
}

/// Largest difference of coefficients over the root mean square of them all.
double difference(const Harmonics& a, const Harmonics& b)
{
    double largest = 0.0, square = 0.0;
    for (std::size_t i = 0; i < a.coefficient.size(); ++i) {
        largest = std::max(largest, glm::length(a.coefficient[i] - b.coefficient[i]));
        square += glm::dot(b.coefficient[i], b.coefficient[i]) / double(a.coefficient.size());
    }
    return largest / std::sqrt(square);
}

std::vector<glm::dmat3> someTurns()
{
    std::vector<glm::dmat3> turns{glm::dmat3(1.0)};
    for (const glm::dvec3& axis :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1), glm::dvec3(1, 2, -3)}) {
        // Among them the poles of Euler's angles, and places right beside them.
        for (const double angle : {1e-9, 1e-4, 0.7, 0.5 * pi, 2.5, pi - 1e-9, pi, -1.1})
            turns.push_back(turn(angle, axis));
    }
    return turns;
}

TEST(Rotation, EvaluatesAsTheFunctionDoesAtTheTurnedDirection)
{
    const Harmonics h = someHarmonics(24);
    for (const glm::dmat3& r : someTurns()) {
        const Harmonics turned = rotated(h, r);
        for (const glm::dvec3& d : {glm::dvec3(0.36, 0.48, -0.8), glm::dvec3(0, 1, 0), glm::dvec3(-0.6, 0, 0.8)}) {
            EXPECT_LT(glm::length(evaluate(turned, r * d) - evaluate(h, d)), 1e-11);
        }
    }
}

// To 1e-12 of the coefficients' size at order 256: bands keep their energies, and turning back gives what was.
TEST(Rotation, IsExactAtHighOrder)
{
    const Harmonics h = someHarmonics(256);
    const auto before = bandEnergies(h);
    for (const glm::dmat3& r : {turn(0.9, {1, 2, -3}), turn(1e-7, {1, 0, 1}), turn(pi / 2, {0, 0, 1})}) {
        const Harmonics turned = rotated(h, r);
        const auto after = bandEnergies(turned);
        for (std::size_t l = 0; l < before.size(); ++l) {
            EXPECT_LT(glm::length(after[l] / before[l] - 1.0), 1e-12) << l;
        }
        EXPECT_LT(difference(rotated(turned, glm::transpose(r)), h), 1e-12);
    }
    EXPECT_LT(difference(rotated(h, glm::dmat3(1.0)), h), 1e-12);
}

TEST(Rotation, EvaluatesAtHighOrder)
{
    // A zonal function about y, which is known along any other axis without rotating: Legendre's addition theorem.
    const int order = 256;
    Harmonics zonal(order), about(order);
    const glm::dvec3 axis = glm::normalize(glm::dvec3(0.3, -0.5, 0.8));
    const auto y = basis(order, axis);
    for (int l = 0; l <= order; ++l) {
        zonal.coefficient[coefficientIndex(l, 0)] = glm::dvec3(std::sqrt((2 * l + 1) / (4 * pi)));
        for (int m = -l; m <= l; ++m) about.coefficient[coefficientIndex(l, m)] = glm::dvec3(y[coefficientIndex(l, m)]);
    }
    const glm::dvec3 up(0, 1, 0);
    const glm::dmat3 r = turn(std::acos(glm::dot(up, axis)), glm::cross(up, axis));
    EXPECT_LT(difference(rotated(zonal, r), about), 1e-11);
}

TEST(Rotation, Composes)
{
    const Harmonics h = someHarmonics(64);
    const glm::dmat3 a = turn(0.9, {1, 2, -3}), b = turn(2.2, {-1, 0.3, 0.2});
    EXPECT_LT(difference(rotated(rotated(h, a), b), rotated(h, b * a)), 1e-12);
}

TEST(Rotation, IsStableFarBeyond)
{
    Harmonics h(600);
    for (int m = -600; m <= 600; ++m) h.coefficient[coefficientIndex(600, m)] = glm::dvec3(std::sin(3.0 * m + 1.0));
    const Harmonics turned = rotated(h, turn(1.3, {3, 1, 2}));
    EXPECT_NEAR(bandEnergies(turned)[600].r / bandEnergies(h)[600].r, 1.0, 1e-11);
    EXPECT_LT(difference(rotated(turned, turn(-1.3, {3, 1, 2})), h), 1e-9);
}

TEST(Rotation, ThreadsDoNotChangeABit)
{
    const Harmonics h = someHarmonics(40);
    const glm::dmat3 r = turn(0.9, {1, 2, -3});
    const Harmonics many = rotated(h, r);
    const ThreadLimit one(1);
    EXPECT_EQ(rotated(h, r).coefficient, many.coefficient);
}

}  // namespace
}  // namespace virga::sh
