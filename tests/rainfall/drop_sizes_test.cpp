#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Error.h"
#include "rainfall/DropSizes.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::rainfall {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double mm = 1e-3;

TEST(DropSizes, TheRateAskedForFalls)
{
    for (const double rate : {1e-6, 1e-3, 0.1, 1.0, 5.0, 25.0, 100.0, 1000.0, 1e6}) {
        const DropSizes sizes(rate);
        EXPECT_NEAR(sizes.impliedRate_mm_h() / rate, 1.0, 1e-12) << rate;
        EXPECT_NEAR((sizes.impliedRate_mm_h(0, 1.5 * mm) + sizes.impliedRate_mm_h(1.5 * mm)) / rate, 1.0, 1e-9) << rate;
    }
}

using Json = nlohmann::json;

Json reference(const char* table) { return Json::parse(std::ifstream(VIRGA_TEST_DATA "/microphysics.json"))[table]; }

/// Fall speed [m/s] after Atlas, Srivastava & Sekhon 1973, a fit to Gunn and Kinzer's; negative for the smallest drops.
double atlasSpeed(double diameter) { return 9.65 - 10.3 * std::exp(-600.0 * diameter); }

/// Rain [mm/h] that falls with the speeds of Atlas et al.
double atlasRate(const DropSizes& sizes, double largest, bool cutAtZero)
{
    return 3.6e6 * pi / 6.0 *
           sizes.integrate(
               [&](double d) { return d * d * d * (cutAtZero ? std::max(atlasSpeed(d), 0.0) : atlasSpeed(d)); }, 0.0,
               largest);
}

TEST(DropSizes, MarshallAndPalmerAgreeWithTheReferenceNumbers)
{
    const Json table = reference("marshall_palmer");
    ASSERT_EQ(table.size(), 3u);
    for (const Json& row : table) {
        const auto expectNear = [&](double value, const char* name, double relative = 1e-12) {
            EXPECT_NEAR(value / row[name].get<double>(), 1.0, relative) << name << " " << row["R_mm_h"];
        };
        const DropSizes sizes = DropSizes::marshallPalmer(row["R_mm_h"]);
        const double endless = 1.0;  // [m]
        expectNear(mm * sizes.slope(), "Lambda_per_mm");
        expectNear(sizes.numberPerVolume(), "number_all_per_m3");
        expectNear(sizes.numberPerVolume(0.5 * mm), "number_D>0.5mm");
        expectNear(sizes.numberPerVolume(1.0 * mm), "number_D>1mm");
        expectNear(sizes.numberPerVolume(2.0 * mm), "number_D>2mm");
        expectNear(sizes.moment(1) / sizes.numberPerVolume() / mm, "mean_D_mm");
        expectNear(sizes.medianVolumeDiameter() / mm, "D0_median_volume_mm", 1e-9);  // there 3.67206075 / Lambda
        expectNear(1e3 * sizes.liquidWater(), "liquid_water_g_m3");
        expectNear(sizes.extinction(1.0), "extinction_per_m_Q1");
        expectNear(sizes.extinction(2.0), "extinction_per_m_Q2");
        expectNear(std::log(20.0) / sizes.extinction(1.0), "visibility_m_5pct_contrast_Q1");
        expectNear(sizes.extinction(1.0, 0.5 * mm, 6.0 * mm), "extinction_per_m_Q1_D0.5to6");
        expectNear(atlasRate(sizes, endless, false), "rate_implied_Atlas_unclipped_closed_form");
        // Quadrature over the kink where Atlas's speed becomes 0 has an error of its own.
        expectNear(atlasRate(sizes, endless, true), "rate_implied_Atlas_mm_h", 1e-7);
        expectNear(atlasRate(sizes, 6.0 * mm, true), "rate_implied_Atlas_D<=6mm", 1e-7);
        expectNear(8000.0 * row["R_mm_h"].get<double>() / atlasRate(sizes, endless, true),
                   "N0_that_makes_Atlas_rate_exact", 1e-7);
        // Gunn and Kinzer's own speeds, against a fit to them and a table made of them.
        expectNear(sizes.impliedRate_mm_h(), "rate_implied_Atlas_mm_h", 0.006);
        expectNear(sizes.impliedRate_mm_h(), "rate_implied_Table2_mm_h", 0.006);
    }
}

TEST(DropSizes, OursAreMarshallAndPalmersOfTheRateThatFalls)
{
    for (const Json& row : reference("marshall_palmer")) {
        const double rate = row["R_mm_h"];
        const DropSizes ours(rate), theirs = DropSizes::marshallPalmer(rate);
        EXPECT_EQ(ours.slope(), theirs.slope());
        EXPECT_NEAR(mm * ours.intercept() / row["N0_that_makes_Atlas_rate_exact"].get<double>(), 1.0, 0.006);
        const double scale = theirs.intercept() / ours.intercept();
        EXPECT_NEAR(scale * ours.numberPerVolume(0.5 * mm, 6 * mm), theirs.numberPerVolume(0.5 * mm, 6 * mm), 1e-9);
        // Beyond 8 mm theirs have a little more: its share of the water is known.
        const double x = ours.slope() * ours.largestDiameter();
        const double beyond = std::exp(-x) * (1.0 + x + x * x / 2.0 + x * x * x / 6.0);
        EXPECT_NEAR(scale * ours.liquidWater() / theirs.liquidWater(), 1.0 - beyond, 1e-12);
    }
    EXPECT_TRUE(DropSizes::marshallPalmer(0).empty());
    EXPECT_EQ(DropSizes::marshallPalmer(0).medianVolumeDiameter(), 0.0);
    EXPECT_THROW(DropSizes::marshallPalmer(-1), Error);
}

// A camera's frustum from Zn to Zf, in which a drop of diameter D at distance Z is f D / Z pixels wide.
TEST(DropSizes, DropsInAFrustumAgreeWithTheReferenceNumbers)
{
    const Json table = reference("counts");
    ASSERT_EQ(table.size(), 6u);
    const double smallest = 0.5 * mm, largest = 6 * mm;
    for (const Json& row : table) {
        const auto value = [&](const char* name) { return row[name].get<double>(); };
        const auto expectNear = [&](double count, const char* name, double relative = 1e-12) {
            EXPECT_NEAR(count / value(name), 1.0, relative) << name << " " << row["R_mm_h"];
        };
        const DropSizes sizes = DropSizes::marshallPalmer(value("R_mm_h"));
        const double f = value("f_px"), near = value("Zn_m"), far = value("Zf_m");
        const double opening = value("width_px") * value("height_px") / (f * f);  // [sr], cross-section over Z^2
        const auto volumeTo = [&](double z) { return opening * (z * z * z - near * near * near) / 3.0; };
        expectNear(volumeTo(far), "volume_m3");
        expectNear(sizes.numberPerVolume(smallest, largest), "drops_per_m3_D0.5to6");
        expectNear(volumeTo(far) * sizes.numberPerVolume(smallest, largest), "drops_in_frustum");
        expectNear((far - near) * sizes.extinction(1.0, smallest, largest), "optical_depth_Q1_over_Zf");
        const auto atLeastThisWide = [&](double pixels) {
            // Piecewise: up to near, from there to far, and all of the frustum.
            const double atNear = std::clamp(pixels * near / f, smallest, largest);
            const double atFar = std::clamp(pixels * far / f, smallest, largest);
            const auto seen = [&](double d) { return volumeTo(f * d / pixels); };
            return sizes.integrate(seen, atNear, atFar) + volumeTo(far) * sizes.numberPerVolume(atFar, largest);
        };
        expectNear(atLeastThisWide(1.0), "of_them_at_least_1px_wide", 1e-10);
        expectNear(atLeastThisWide(0.25), "at_least_0.25px", 1e-10);
        expectNear(atLeastThisWide(0.1), "at_least_0.1px", 1e-10);
        // Drops that fall into the frustum from above: through its cross-section seen from there.
        const double floor = value("width_px") / f * (far * far - near * near) / 2.0;
        expectNear(sizes.integrate(atlasSpeed, smallest, largest) / 60.0 * floor, "extra_entering_in_1/60s", 1e-10);
    }
}

TEST(DropSizes, ClosedFormsAgreeWithQuadrature)
{
    for (const double rate : {0.01, 1.0, 30.0, 1000.0}) {
        for (const double multiplier : {0.5, 1.0, 3.0}) {
            const DropSizes sizes(rate, multiplier);
            for (const auto& [d0, d1] : {std::array{0.0, 1.0}, std::array{0.3e-3, 0.31e-3}, std::array{2e-3, 5e-3},
                                         std::array{3.99e-3, 3.9900001e-3}}) {
                for (int k = 0; k <= 6; ++k) {
                    const double numeric = sizes.integrate([k](double d) { return std::pow(d, k); }, d0, d1);
                    const double closed = sizes.moment(k, d0, d1);
                    EXPECT_NEAR(closed, numeric, 1e-11 * numeric)
                        << rate << " mm/h, " << d0 << " to " << d1 << ", " << k;
                }
            }
        }
    }
    const DropSizes sizes(10);
    EXPECT_NEAR(sizes.extinction(2.0), pi * sizes.intercept() / std::pow(sizes.slope(), 3), 1e-6 * sizes.extinction());
}

TEST(DropSizes, ExtinctionFollowsTheKnownPowerLaw)
{
    // 0.365 R^0.63 /km for N0 = 8000; ours has 5 to 18 % fewer drops.
    for (const double rate : {1.0, 5.0, 25.0, 50.0}) {
        const double ratio = 1e3 * DropSizes(rate).extinction(2.0) / (0.365 * std::pow(rate, 0.63));
        EXPECT_GT(ratio, 0.82);
        EXPECT_LT(ratio, 0.96);
    }
}

TEST(DropSizes, SplashFluxIsNumberTimesSpeed)
{
    const DropSizes sizes(25);
    const double narrow = sizes.impactsPerAreaAndTime(2 * mm, 2.001 * mm);
    EXPECT_NEAR(narrow, sizes.numberPerVolume(2 * mm, 2.001 * mm) * terminalSpeed(2.0005 * mm), 1e-4 * narrow);
    EXPECT_GT(sizes.impactsPerAreaAndTime(), sizes.impactsPerAreaAndTime(1 * mm));
}

TEST(DropSizes, NoRainIsNoRain)
{
    const DropSizes sizes(0);
    EXPECT_TRUE(sizes.empty());
    EXPECT_EQ(sizes.numberPerVolume(), 0.0);
    EXPECT_EQ(sizes.extinction(), 0.0);
    EXPECT_EQ(sizes.impactsPerAreaAndTime(), 0.0);
    EXPECT_EQ(sizes.impliedRate_mm_h(), 0.0);
    EXPECT_EQ(sizes.density(1 * mm), 0.0);
}

TEST(DropSizes, TheMultiplierScalesDiametersAndKeepsTheNumber)
{
    const DropSizes plain(20);
    const DropSizes doubled(20, 2.0);
    EXPECT_NEAR(doubled.numberPerVolume(), plain.numberPerVolume(), 1e-9 * plain.numberPerVolume());
    EXPECT_NEAR(doubled.numberPerVolume(3 * mm), plain.numberPerVolume(1.5 * mm), 1e-9 * plain.numberPerVolume());
    EXPECT_NEAR(doubled.extinction(), 4.0 * plain.extinction(), 1e-9);
    EXPECT_NEAR(doubled.liquidWater(), 8.0 * plain.liquidWater(), 1e-12);
}

TEST(DropSizes, RefusesWhatIsNotARate)
{
    for (const double rate : {-1.0, 1.1e6, std::nan(""), std::numeric_limits<double>::infinity()}) {
        EXPECT_THROW(DropSizes{rate}, Error) << rate;
    }
    EXPECT_THROW(DropSizes(1.0, 0.0), Error);
    EXPECT_THROW(DropSizes(1.0, std::nan("")), Error);
}

TEST(DropSizes, SamplesTheEndsOfAnInterval)
{
    const DropSizes sizes(10);
    EXPECT_EQ(sizes.sampleDiameter(0.0, 1 * mm, 2 * mm), 1 * mm);
    EXPECT_NEAR(sizes.sampleDiameter(1.0, 1 * mm, 2 * mm), 2 * mm, 1e-15);
    EXPECT_NEAR(sizes.sampleDiameter(1.0), 8 * mm, 1e-9);
    EXPECT_EQ(sizes.sampleDiameter(0.5, 2 * mm, 2 * mm), 2 * mm);
}

// Chi-square over 40 equal bins of diameter in [0.4, 4] mm, 200,000 samples, fixed seed: 39 degrees of freedom, so a
// correct sampler passes 72.05 with probability 0.001.
TEST(DropSizes, SamplesFollowMarshallAndPalmer)
{
    const DropSizes sizes(30);
    const double d0 = 0.4 * mm, d1 = 4.0 * mm;
    constexpr int bins = 40, count = 200'000;
    std::array<int, bins> seen{};
    std::uint64_t state = 7;
    for (int i = 0; i < count; ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        const double u = double(state >> 11) * 0x1p-53;
        const double d = sizes.sampleDiameter(u, d0, d1);
        ++seen[std::size_t(std::min(bins - 1, int((d - d0) / (d1 - d0) * bins)))];
    }
    double chiSquare = 0.0;
    for (int i = 0; i < bins; ++i) {
        const double a = d0 + (d1 - d0) * i / bins, b = d0 + (d1 - d0) * (i + 1) / bins;
        const double expected = count * sizes.numberPerVolume(a, b) / sizes.numberPerVolume(d0, d1);
        ASSERT_GT(expected, 5.0);
        chiSquare += (seen[std::size_t(i)] - expected) * (seen[std::size_t(i)] - expected) / expected;
    }
    EXPECT_LT(chiSquare, 72.05);
}

}  // namespace
}  // namespace virga::rainfall
