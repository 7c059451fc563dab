#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/Error.h"
#include "rainfall/SizeClasses.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::rainfall {
namespace {

constexpr double pi = std::numbers::pi;

TEST(SizeClasses, AddUpToTheRain)
{
    for (const double rate : {0.1, 5.0, 25.0, 200.0, 1000.0}) {
        const DropSizes sizes(rate);
        const SizeClassOptions options;
        const auto classes = makeSizeClasses(sizes, options);
        ASSERT_EQ(classes.size(), 32u);
        double number = 0, area = 0, water = 0, weight = 0;
        double edge = options.smallestDiameter;
        for (const SizeClass& c : classes) {
            EXPECT_EQ(c.d0, edge);
            EXPECT_GT(c.d1, c.d0);
            edge = c.d1;
            number += c.numberPerVolume;
            area += c.numberPerVolume * c.meanSquare;
            water += 3.6e6 * pi / 6.0 * c.numberPerVolume * c.meanCube * c.speed;
            weight += c.weight;
        }
        EXPECT_EQ(edge, sizes.largestDiameter());
        const double d0 = options.smallestDiameter;
        EXPECT_NEAR(number, sizes.numberPerVolume(d0), 1e-10 * number);
        EXPECT_NEAR(area, sizes.moment(2, d0), 1e-10 * area);
        EXPECT_NEAR(water, sizes.impliedRate_mm_h(d0), 1e-10 * water);
        EXPECT_NEAR(weight, 1.0, 1e-10);
    }
}

TEST(SizeClasses, HoldAboutEquallyManyStrokesOfOneSpeed)
{
    for (const double rate : {1.0, 25.0, 200.0}) {
        double rms = 0.0;
        for (const SizeClass& c : makeSizeClasses(DropSizes(rate))) {
            EXPECT_LT(c.weight, 1.5 / 32 + 1e-3) << c.d0;
            EXPECT_LE(terminalSpeed(c.d1) - terminalSpeed(c.d0), 3.0 / 32 * 9.23) << c.d0;
            EXPECT_LT(c.speedError, 0.55);
            rms += c.weight * c.speedError * c.speedError;
        }
        EXPECT_LT(std::sqrt(rms), 0.13) << rate;
    }
}

TEST(SizeClasses, MeansLieInsideTheClass)
{
    for (const SizeClass& c : makeSizeClasses(DropSizes(10))) {
        EXPECT_GT(c.meanDiameter, c.d0);
        EXPECT_LT(c.meanDiameter, c.d1);
        EXPECT_GE(c.meanSquare, c.meanDiameter * c.meanDiameter);
        EXPECT_GE(std::cbrt(c.meanCube), std::sqrt(c.meanSquare) * (1 - 1e-12));
        EXPECT_GE(c.speed, terminalSpeed(c.d0));
        EXPECT_LE(c.speed, terminalSpeed(c.d1));
    }
}

TEST(SizeClasses, AnyRateAndCount)
{
    EXPECT_TRUE(makeSizeClasses(DropSizes(0)).empty());
    for (const double rate : {1e-6, 1e-3, 1e6}) {
        for (const int count : {1, 7, 256}) {
            for (const SizeClass& c : makeSizeClasses(DropSizes(rate), {.count = count})) {
                EXPECT_TRUE(std::isfinite(c.speed) && c.speed > 0.0);
                EXPECT_TRUE(std::isfinite(c.meanCube) && c.meanCube > 0.0);
            }
        }
    }
    EXPECT_THROW(makeSizeClasses(DropSizes(1), {.count = 0}), Error);
    EXPECT_THROW(makeSizeClasses(DropSizes(1), {.smallestDiameter = 9e-3}), Error);
}

}  // namespace
}  // namespace virga::rainfall
