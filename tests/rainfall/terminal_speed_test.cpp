#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "rainfall/TerminalSpeed.h"

namespace virga::rainfall {
namespace {

// Gunn & Kinzer 1949 as cloud models carry it; diameter [mm], speed [m/s].
constexpr double gunnKinzer[][2] = {{0.1, .27},  {0.2, .72},  {0.3, 1.17}, {0.4, 1.62}, {0.5, 2.06}, {0.6, 2.47},
                                    {0.8, 3.27}, {1.0, 4.03}, {1.2, 4.64}, {1.4, 5.17}, {1.6, 5.65}, {1.8, 6.09},
                                    {2.0, 6.49}, {2.4, 7.27}, {2.8, 7.82}, {3.0, 8.06}, {3.4, 8.44}, {4.0, 8.83},
                                    {4.4, 8.98}, {5.0, 9.09}, {5.8, 9.17}};

TEST(TerminalSpeed, MeetsGunnAndKinzer)
{
    for (const auto& [diameter_mm, speed] : gunnKinzer) {
        EXPECT_NEAR(terminalSpeed(1e-3 * diameter_mm), speed, 1e-9) << diameter_mm << " mm";
    }
}

// Atlas, Srivastava & Sekhon 1973, v = 9.65 - 10.3 exp(-0.6 D), is a fit to the same measurements, good to 0.16 m/s.
TEST(TerminalSpeed, StaysCloseToAtlasBetweenThePoints)
{
    for (double diameter_mm = 0.5; diameter_mm <= 5.8; diameter_mm += 0.01) {
        EXPECT_NEAR(terminalSpeed(1e-3 * diameter_mm), 9.65 - 10.3 * std::exp(-0.6 * diameter_mm), 0.2) << diameter_mm;
    }
}

// Rousseau et al. 2006, Table 2, is Gunn and Kinzer's up to 0.45 mm of radius and 0.1 m/s off theirs beyond.
TEST(TerminalSpeed, StaysCloseToRousseausTable)
{
    const auto table = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/microphysics.json"))["terminal"];
    ASSERT_EQ(table["table2_radius_mm"].size(), 23u);
    for (std::size_t i = 0; i < 23; ++i) {
        const double radius_mm = table["table2_radius_mm"][i], speed = table["table2_speed"][i];
        EXPECT_NEAR(terminalSpeed(2e-3 * radius_mm), speed, radius_mm < 0.475 ? 1e-9 : 0.13) << radius_mm;
        EXPECT_NEAR(9.65 - 10.3 * std::exp(-1.2 * radius_mm), table["atlas_at_table2"][i].get<double>(), 1e-12);
    }
}

TEST(TerminalSpeed, GrowsSmoothlyFromDrizzleToBreakUp)
{
    const double step = 1e-6;
    double previousSlope = 0.0;
    for (double diameter = step; diameter < 20e-3; diameter += step) {
        const double slope = (terminalSpeed(diameter + step) - terminalSpeed(diameter)) / step;
        EXPECT_GE(slope, 0.0) << diameter;
        // No kink: the slope of 0 to 5 m/s per mm changes by under 4 % of that from one micrometre to the next.
        if (previousSlope > 0.0) {
            EXPECT_NEAR(slope, previousSlope, 200.0) << diameter;
        }
        previousSlope = slope;
    }
    EXPECT_GT(terminalSpeed(5e-5), 0.05);
    EXPECT_LT(terminalSpeed(5e-5), 0.075);  // Stokes's law alone
    EXPECT_LT(terminalSpeed(8e-3), 9.23);
}

TEST(TerminalSpeed, NothingDoesNotFall)
{
    EXPECT_EQ(terminalSpeed(0.0), 0.0);
    EXPECT_EQ(terminalSpeed(-1.0), 0.0);
    EXPECT_EQ(terminalSpeed(std::nan("")), 0.0);
}

}  // namespace
}  // namespace virga::rainfall
