#include "optics/Fresnel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;

/// Power transmittance from Fresnel's amplitude coefficients, computed on its own.
double transmittance(double gamma, double n, bool s)
{
    const double cosI = std::cos(gamma);
    const double cosT = std::sqrt(1.0 - std::sin(gamma) * std::sin(gamma) / (n * n));
    const double t = s ? 2.0 * cosI / (cosI + n * cosT) : 2.0 * cosI / (n * cosI + cosT);
    return n * cosT / cosI * t * t;
}

TEST(Fresnel, ReflectedAndTransmittedPowerAddUp)
{
    for (const double n : {1.0001, 1.331, 1.333, 1.5, 2.5}) {
        for (double degrees = 0.0; degrees < 90.0; degrees += 0.5) {
            const double gamma = degrees * pi / 180.0;
            const Fresnel r = fresnel(std::cos(gamma), n);
            EXPECT_NEAR(r.s + transmittance(gamma, n, true), 1.0, 1e-12);
            EXPECT_NEAR(r.p + transmittance(gamma, n, false), 1.0, 1e-12);
        }
    }
}

TEST(Fresnel, IsTheSameFromBothSides)
{
    for (double degrees = 0.0; degrees < 90.0; degrees += 1.0) {
        const double gamma = degrees * pi / 180.0;
        const double beta = std::asin(std::sin(gamma) / 1.333);
        const Fresnel outside = fresnel(std::cos(gamma), 1.333);
        const Fresnel inside = fresnel(std::cos(beta), 1.0 / 1.333);
        EXPECT_NEAR(outside.s, inside.s, 1e-12);
        EXPECT_NEAR(outside.p, inside.p, 1e-12);
    }
}

TEST(Fresnel, EndsAndBrewster)
{
    const double normal = std::pow(0.333 / 2.333, 2);
    EXPECT_NEAR(fresnel(1.0, 1.333).s, normal, 1e-16);
    EXPECT_NEAR(fresnel(1.0, 1.333).p, normal, 1e-16);
    EXPECT_EQ(fresnel(0.0, 1.333).mean(), 1.0);
    EXPECT_EQ(fresnel(0.0, 1.0 / 1.333).mean(), 1.0);
    EXPECT_EQ(fresnel(std::cos(criticalAngle(1.333) + 1e-6), 1.0 / 1.333).mean(), 1.0);
    EXPECT_NEAR(fresnel(std::cos(brewsterAngle(1.333)), 1.333).p, 0.0, 1e-30);
    EXPECT_GT(fresnel(std::cos(brewsterAngle(1.333)), 1.333).s, 0.07);
}

TEST(Fresnel, AgreesWithTheReferenceNumbers)
{
    const auto table = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/fresnel.json"));
    ASSERT_EQ(table["angle_deg"].size(), 91u);
    for (std::size_t i = 0; i < table["angle_deg"].size(); ++i) {
        const double degrees = table["angle_deg"][i];
        const Fresnel r = fresnel(degrees == 90.0 ? 0.0 : std::cos(degrees * pi / 180.0), 1.333);
        EXPECT_NEAR(r.s, table["Rs"][i].get<double>(), 2e-15) << degrees;
        EXPECT_NEAR(r.p, table["Rp"][i].get<double>(), 2e-15) << degrees;
        EXPECT_NEAR(r.mean(), table["R"][i].get<double>(), 2e-15) << degrees;
    }
    // Over the disc that a drop shows to parallel light: sin(2 gamma) d gamma, substituted for smoothness.
    const GaussLegendre rule(64);
    double mean = 0.0;
    for (std::size_t i = 0; i < rule.node.size(); ++i) {
        const double cosine = 0.5 * (1 + rule.node[i]);
        mean += rule.weight[i] * cosine * fresnel(cosine, 1.333).mean();
    }
    EXPECT_NEAR(mean, table["mean_R_over_disc"].get<double>(), 1e-15);
    const double tenth = table["deg_where_R_is_10_percent"].get<double>() * pi / 180;
    EXPECT_NEAR(fresnel(std::cos(tenth), 1.333).mean(), 0.1, 1e-15);
    // Light that just grazes the drop on its way in and out is turned by this much; twice that is what a drop sees.
    EXPECT_NEAR(2 * (180 - 2 * criticalAngle(1.333) * 180 / pi), table["drop_field_of_view_deg"].get<double>(), 1e-12);
    EXPECT_NEAR(brewsterAngle(1.333) * 180 / pi, table["brewster_deg"].get<double>(), 1e-12);
    EXPECT_NEAR(criticalAngle(1.333) * 180 / pi, table["critical_deg"].get<double>(), 1e-12);
}

}  // namespace
}  // namespace virga::optics
