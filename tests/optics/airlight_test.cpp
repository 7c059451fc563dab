#include "optics/Airlight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "optics/AirlightQuadrature.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Integral of f from a to b, in `panels` panels of 20 nodes.
double integral(const std::function<double(double)>& f, double a, double b, int panels)
{
    static const GaussLegendre rule(20);
    double sum = 0.0;
    for (int panel = 0; panel < panels; ++panel) {
        const double half = 0.5 * (b - a) / panels, middle = a + (2 * panel + 1) * half;
        for (std::size_t i = 0; i < rule.node.size(); ++i)
            sum += half * rule.weight[i] * f(middle + half * rule.node[i]);
    }
    return sum;
}

/// The single-scattering integral as physics has it, over the way x along the ray. x = s + h sinh(t) keeps 1/d^2
/// smooth.
double alongTheRay(double s, double h, double distance, double beta)
{
    const auto f = [&](double t) {
        const double x = s + h * std::sinh(t), d = h * std::cosh(t);
        return std::exp(-beta * (x + d)) / d;  // dx = d dt
    };
    const double end = std::min(distance, std::max(s, 0.0) + 40.0 / beta);
    return beta / (4.0 * pi) * integral(f, std::asinh(-s / h), std::asinh((end - s) / h), 200);
}

TEST(Airlight, AgreesWithTheReferenceNumbers)
{
    const auto table = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/airlight.json"));
    for (const auto& row : table["rows"]) {
        const double beta = row[0], light = row[1], surface = row[2], angle = row[3].get<double>() * pi / 180.0;
        const double exact = row[4];
        EXPECT_NEAR(airlight(light * std::cos(angle), light * std::sin(angle), surface, beta) / exact, 1.0, 1e-13)
            << row;
    }
}

TEST(Airlight, IsTheIntegralOverTheRay)
{
    for (const double beta : {1e-4, 0.003, 0.05, 0.4, 3.0})
        for (const double s : {-80.0, -6.0, -0.3, 0.0, 0.2, 4.0, 30.0, 150.0})
            for (const double h : {0.01, 0.3, 2.0, 25.0})
                for (const double distance : {0.1, 3.0, 29.0, 31.0, 200.0, infinity}) {
                    const double exact = alongTheRay(s, h, distance, beta);
                    EXPECT_NEAR(airlight(s, h, distance, beta) / exact, 1.0, 1e-11)
                        << "beta " << beta << " s " << s << " h " << h << " D " << distance;
                }
}

// What the camera sees is what it sees of the first part, and what a camera at that part's end sees, dimmed.
TEST(Airlight, OfTwoPartsAddsUp)
{
    for (const double beta : {0.002, 0.05, 0.7})
        for (const double s : {-20.0, 0.0, 7.0, 40.0})
            for (const double h : {0.02, 1.0, 12.0})
                for (const double first : {0.5, 7.0, 20.0})
                    for (const double second : {0.001, 1.0, 60.0, infinity}) {
                        const double whole = airlight(s, h, first + second, beta);
                        const double parts = airlight(s, h, first, beta) +
                                             std::exp(-beta * first) * airlight(s - first, h, second, beta);
                        EXPECT_NEAR(parts / whole, 1.0, 1e-12) << beta << ' ' << s << ' ' << h << ' ' << first;
                    }
}

// Two thin slices next to each other: the paper's F - F would keep no digit of the second.
TEST(Airlight, OfAThinSliceKeepsItsDigits)
{
    const double beta = 0.01, s = -50.0, h = 1e-6, distance = 1e-9;
    const double integrand = std::exp(-beta * 50.0) / 2500.0;
    EXPECT_NEAR(airlight(s, h, distance, beta) / (beta / (4.0 * pi) * integrand * distance), 1.0, 1e-9);
}

TEST(Airlight, OfClearAirIsNone)
{
    EXPECT_EQ(airlight(3.0, 1.0, 10.0, 0.0), 0.0);
    EXPECT_EQ(airlight(3.0, 0.0, 10.0, 0.0), 0.0);
    EXPECT_EQ(airlight(3.0, 1.0, 0.0, 0.1), 0.0);
}

// Without extinction on the way 1/d^2 integrates to the angle that the ray covers as seen from the lamp.
TEST(Airlight, OfThinAirIsAnAngle)
{
    const double beta = 1e-12, s = 4.0, h = 0.7, distance = 9.0;
    const double angle = std::atan((distance - s) / h) + std::atan(s / h);
    EXPECT_NEAR(airlight(s, h, distance, beta) / (beta / (4.0 * pi * h) * angle), 1.0, 1e-10);
}

TEST(Airlight, OnTheRayAndInTheCamera)
{
    const double beta = 0.03;
    EXPECT_EQ(airlight(5.0, 0.0, 10.0, beta), infinity);
    EXPECT_EQ(airlight(5.0, 0.0, infinity, beta), infinity);
    EXPECT_EQ(airlight(0.0, 0.0, 10.0, beta), infinity);
    // Behind the surface and behind the camera it is finite, and the limit of lamps ever nearer to the ray.
    EXPECT_NEAR(airlight(15.0, 0.0, 10.0, beta) / (beta / (4 * pi) * std::exp(-beta * 15.0) * (1.0 / 5.0 - 1.0 / 15.0)),
                1.0, 1e-13);
    for (const double s : {15.0, -15.0})
        for (const double distance : {10.0, 1e-3})
            EXPECT_NEAR(airlight(s, 1e-7, distance, beta) / airlight(s, 0.0, distance, beta), 1.0, 1e-10) << s;
    EXPECT_NEAR(airlight(-15.0, 1e-7, infinity, beta) / airlight(-15.0, 0.0, infinity, beta), 1.0, 1e-10);
}

// All light that reaches a point a distance R from the lamp, scattered once: over spheroids about the two,
//   beta / R integral_1^inf exp(-beta R xi) ln((xi + 1) / (xi - 1)) / xi d xi.
TEST(Airlight, FromAllDirectionsIsWhatTheMediumScatters)
{
    for (const double depth : {0.01, 0.5, 4.0}) {
        const double distance = 12.0, beta = depth / distance;
        // Angles off the lamp and xi - 1 on a log scale: the one goes as 1/angle, the other as a logarithm.
        const auto ring = [&](double u) {
            const double angle = std::exp(u);
            return 2.0 * pi * std::sin(angle) * angle *
                   airlight(distance * std::cos(angle), distance * std::sin(angle), infinity, beta);
        };
        const double seen = integral(ring, std::log(1e-14), std::log(pi), 60);
        const auto spheroid = [&](double u) {
            const double beyond = std::exp(u), xi = 1.0 + beyond;
            return beyond * std::exp(-depth * xi) * std::log1p(2.0 / beyond) / xi;
        };
        const double scattered = beta / distance * integral(spheroid, -36.0, std::log(60.0 / depth), 60);
        EXPECT_NEAR(seen / scattered, 1.0, 1e-10) << depth;
    }
}

TEST(AirlightQuadrature, IsCloseEverywhere)
{
    // Lamps in all directions, near and far; surfaces before, at and behind them; from drizzle to a wall of fog.
    double largest = 0.0, squares = 0.0;
    int count = 0;
    for (double beta = 1e-5; beta < 12.0; beta *= 1.7)
        for (double light = 0.01; light < 3000.0; light *= 1.9)
            for (const double degrees : {0.0, 0.01, 0.1, 0.5, 2.0, 6.0, 15.0, 35.0, 60.0, 90.0, 130.0, 170.0, 180.0})
                for (double surface = 0.02; surface < 1e8; surface *= 2.3) {
                    const double radius = 0.02, angle = degrees * pi / 180.0;
                    const double distance = surface < 5e7 ? surface : infinity;
                    const double s = light * std::cos(angle), h = std::max(radius, light * std::sin(angle));
                    const double exact = airlight(s, h, distance, beta);
                    if (exact < 1e-30) continue;  // out of float's reach
                    // A ray in no special direction, the lamp off it sideways.
                    const glm::dvec3 ray = glm::normalize(glm::dvec3(0.3, -0.2, -0.9));
                    const glm::dvec3 side = glm::normalize(glm::cross(ray, glm::dvec3(0, 1, 0)));
                    const glm::dvec3 place = s * ray + light * std::sin(angle) * side;
                    const double found = shared::airlightQuadrature(glm::vec3(ray), float(distance), glm::vec3(place),
                                                                    float(radius), float(beta));
                    const double error = std::abs(found / exact - 1.0);
                    ASSERT_TRUE(std::isfinite(found));
                    // Nearly on the ray, h is what float makes of a difference of two lengths of `light`.
                    const double off = light * std::sin(angle),
                                 rounding = off > 0.9 * radius ? 2e-7 * light / off : 0.0;
                    EXPECT_LT(error, 4.4e-4 + rounding)
                        << "beta " << beta << " light " << light << " at " << degrees << " deg, D " << distance;
                    largest = std::max(largest, error);
                    squares += error * error;
                    ++count;
                }
    const double rms = std::sqrt(squares / count);
    RecordProperty("largest", std::to_string(largest));
    RecordProperty("rms", std::to_string(rms));
    EXPECT_GT(count, 100000);
    EXPECT_LT(rms, 1.2e-4);
}

TEST(AirlightQuadrature, TakesAnyDistanceAndPlace)
{
    const glm::vec3 ray(0, 0, -1), lamp(0, 0, -5);
    const float inf = std::numeric_limits<float>::infinity();
    EXPECT_EQ(shared::airlightQuadrature(ray, 10.0f, lamp, 0.1f, 0.0f), 0.0f);
    EXPECT_EQ(shared::airlightQuadrature(ray, 0.0f, lamp, 0.1f, 0.1f), 0.0f);
    const float open = shared::airlightQuadrature(ray, inf, lamp, 0.1f, 0.1f);
    EXPECT_NEAR(shared::airlightQuadrature(ray, 1e30f, lamp, 0.1f, 0.1f) / open, 1.0f, 1e-6f);
    EXPECT_NEAR(open / airlight(5.0, 0.1, infinity, 0.1), 1.0, 5e-4);
    EXPECT_NEAR(shared::airlight(ray, inf, lamp, 0.1f) / airlight(5.0, shared::pointLightRadius, infinity, 0.1), 1.0,
                5e-4);
    // In the camera, without a radius, in air so clear that 9 / beta is no float: finite.
    EXPECT_TRUE(std::isfinite(shared::airlightQuadrature(ray, inf, glm::vec3(0), 0.0f, 0.1f)));
    EXPECT_TRUE(std::isfinite(shared::airlightQuadrature(ray, inf, lamp, 0.0f, 1e-38f)));
    EXPECT_TRUE(std::isfinite(shared::airlightQuadrature(ray, inf, 1e6f * lamp, 0.0f, 1e-6f)));
}

}  // namespace
}  // namespace virga::optics
