#include "particles/Motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "particles/CellHash.h"
#include "particles/PoissonTable.h"
#include "support/Statistics.h"

namespace virga::particles {
namespace {

// 100,000 hashed numbers a mean, about as many bins as standard deviations times 8; each of the five fails by chance
// once in 10,000.
TEST(PoissonTable, FollowsTheLaw)
{
    constexpr int samples = 100'000;
    for (const double mean : {0.02, 0.7, 8.0, 60.0, 900.0}) {
        const PoissonTable table(mean);
        const int last = int(mean + 12 * std::sqrt(mean) + 24);
        std::vector<int> seen(std::size_t(last) + 1);
        std::vector<double> expected(seen.size());
        for (int i = 0; i < samples; ++i) {
            const int n = table(unitDouble(mix(std::uint64_t(i))));
            ASSERT_LE(n, last);
            ++seen[std::size_t(n)];
        }
        for (int n = 0; n <= last; ++n)
            expected[std::size_t(n)] = samples * std::exp(n * std::log(mean) - mean - std::lgamma(n + 1.0));
        const test::ChiSquare chiSquare(seen, expected);
        ASSERT_GE(chiSquare.bins, 2) << mean;
        EXPECT_LT(chiSquare.statistic, chiSquare.limit()) << mean << ", " << chiSquare.bins << " bins";
    }
}

TEST(PoissonTable, TheSameNumberForTheSameUAndNeverFewerForMore)
{
    const PoissonTable table(8);
    int before = 0;
    for (double u = 0; u < 1; u += 1e-4) {
        EXPECT_GE(table(u), before);
        before = table(u);
    }
    EXPECT_EQ(PoissonTable(0)(0.0), 0);
    EXPECT_EQ(PoissonTable(0)(1 - 0x1p-53), 0);
    EXPECT_LT(PoissonTable(1000)(1 - 0x1p-53), 1500);
}

constexpr MotionSettings windy = {.wind = {4, -7}, .gust = 2.5, .turbulence = 0.4, .speedScale = 1.3, .seed = 11};

TEST(Motion, VelocityIsTheDerivativeOfTheWay)
{
    const Motion motion(windy);
    for (const double t : {0.0, 0.3, 17.0, 1234.5}) {
        const double h = 1e-4;
        const glm::dvec3 slope = (motion.displacement(6, t + h) - motion.displacement(6, t - h)) / (2 * h);
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(motion.velocity(6, t)[axis], slope[axis], 1e-6) << t;
    }
    EXPECT_EQ(motion.displacement(6, 0), glm::dvec3(0));
    EXPECT_NEAR(motion.velocity(6, 1).y, -6 * 1.3, 1e-12);
}

// 100,000 s hold over 5,000 turns of the slowest gust: the mean square of three sines is met to under 0.1 %.
TEST(Motion, GustsHaveTheRmsAskedForAndBlowAlongTheWind)
{
    for (const glm::dvec2 wind : {glm::dvec2(3, 4), glm::dvec2(0, 0)}) {
        const Motion motion({.wind = wind, .gust = 1.7, .seed = 5});
        glm::dvec2 sum(0), squares(0);
        double cross = 0, farthest = 0;
        constexpr int samples = 1'000'000;
        for (int i = 0; i < samples; ++i) {
            const glm::dvec3 v = motion.velocity(0, 0.1 * i);
            const glm::dvec2 gust(v.x - wind.x, v.z - wind.y);
            sum += gust;
            squares += gust * gust;
            cross += gust.x * gust.y;
            const glm::dvec3 way = motion.displacement(0, 0.1 * i);
            farthest = std::max(farthest, glm::length(glm::dvec2(way.x, way.z) - wind * (0.1 * i)));
        }
        EXPECT_NEAR(std::sqrt((squares.x + squares.y) / samples), 1.7, 0.003 * 1.7);
        EXPECT_LT(glm::length(sum) / samples, 0.01);
        EXPECT_LT(farthest, 20);  // gusts carry nothing away: the way stays bounded over a day
        EXPECT_NEAR(cross * cross, squares.x * squares.y, 1e-6 * squares.x * squares.y);  // one direction
        if (glm::length(wind) > 0) {
            EXPECT_NEAR(squares.x / squares.y, 9.0 / 16, 1e-6);
        }
    }
}

TEST(Motion, SeedsBlowDifferently)
{
    const auto gustAt = [](std::uint32_t seed) {
        return Motion({.wind = {1, 0}, .gust = 1, .seed = seed}).velocity(0, 3).x;
    };
    EXPECT_NE(gustAt(1), gustAt(2));
    EXPECT_EQ(gustAt(2), gustAt(2));
}

// Phases are asked for at cells' corners: along an edge and with time they must turn as the waves say, at any frame.
TEST(Motion, TurbulencePhasesTurnWithPlaceAndTime)
{
    const Motion motion(windy);
    const auto waves = motion.turbulenceWaves(1.0);  // w: turns a second
    const auto apart = [](float a, float b) { return std::abs(std::remainder(double(a) - double(b), 1.0)); };
    for (const double t : {0.0, 5.0, 416'666.625}) {
        const glm::dvec3 place(3.2, -3.9e6, 17);
        const glm::vec4 here = motion.turbulencePhases(place, t, 3);
        const glm::dvec3 step(0.25, -0.5, 1);
        const glm::vec4 there = motion.turbulencePhases(place + step, t, 3);
        const glm::vec4 later = motion.turbulencePhases(place, t + 0.125, 3);
        for (int i = 0; i < 4; ++i) {
            EXPECT_TRUE(here[i] >= 0 && here[i] <= 1);
            const float along = float(glm::dot(glm::dvec3(waves[std::size_t(i)].wave), step));
            EXPECT_LT(apart(there[i], here[i] + along), 1e-5);
            EXPECT_LT(apart(later[i], here[i] + 0.125f * waves[std::size_t(i)].wave.w), 1e-5);
        }
        EXPECT_NE(motion.turbulencePhases(place, t, 4), here);
    }
    EXPECT_EQ(Motion({.turbulence = 0}).turbulenceReach(), 0);
    EXPECT_FALSE(Motion({.turbulence = 0}).hasTurbulence());
}

}  // namespace
}  // namespace virga::particles
