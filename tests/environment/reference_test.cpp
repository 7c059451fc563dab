// The reference's radiance of drops under three analytic environments, order by order: harmonics, transfer function and
// the paper's own arithmetic, without a pixel in between.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Parallel.h"
#include "optics/DropTransfer.h"
#include "sh/Harmonics.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
const optics::DropTransferOptions paper{.index = 1.333, .model = optics::PathModel::Paper, .terms = 9};

/// z is up there: (x, y, z) is (x, z, -y) here.
glm::dvec3 toOurs(const glm::dvec3& d) { return {d.x, d.z, -d.y}; }

/// Integrals of P_l over [a, b], l = 0 to order: (P_(l+1) - P_(l-1)) / (2l + 1).
std::vector<double> legendreIntegrals(double a, double b, int order)
{
    const auto at = [order](double x) {
        std::vector<double> p{1.0, x};
        for (int l = 1; l <= order + 1; ++l) {
            p.push_back(((2 * l + 1) * x * p[std::size_t(l)] - l * p[std::size_t(l) - 1]) / (l + 1));
        }
        return p;
    };
    const std::vector<double> low = at(a), high = at(b);
    std::vector<double> result{b - a};
    for (std::size_t l = 1; l <= std::size_t(order); ++l) {
        result.push_back((high[l + 1] - low[l + 1] - high[l - 1] + low[l - 1]) / (2.0 * double(l) + 1));
    }
    return result;
}

/// Integrals of x P_l over [0, 1], from those of P_(l+1) and P_(l-1).
std::vector<double> firstMoments(int order)
{
    const std::vector<double> plain = legendreIntegrals(0.0, 1.0, order + 1);
    std::vector<double> result{0.5};
    for (std::size_t l = 1; l <= std::size_t(order); ++l) {
        result.push_back(((double(l) + 1) * plain[l + 1] + double(l) * plain[l - 1]) / (2.0 * double(l) + 1));
    }
    return result;
}

class ReferenceRadiance : public testing::Test {
protected:
    static constexpr int order = sh::maxOrder;
    static constexpr std::size_t constant = 0, cosine = 1, sunsky = 2;
    static constexpr const char* names[3] = {"constant", "cosine", "sunsky"};

    nlohmann::json table = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/drop_radiance_harmonics.json"));
    std::vector<glm::dvec3> views;
    glm::dvec3 sun;
    sh::Harmonics environment{order};  // a channel for each of the three
    sh::Harmonics sky{3};              // without the sun, in all channels

    ReferenceRadiance()
    {
        for (const auto& v : table["view"]) views.push_back(toOurs({v[0], v[1], v[2]}));
        const glm::dvec3 lobe = glm::normalize(toOurs({0.3, -0.5, 0.8}));
        sun = toOurs({std::cos(pi / 4) * std::cos(pi / 6), std::cos(pi / 4) * std::sin(pi / 6), std::sin(pi / 4)});

        const std::vector<double> moment = firstMoments(order), above = legendreIntegrals(0, 1, order),
                                  below = legendreIntegrals(-1, 0, order),
                                  disc = legendreIntegrals(std::cos(0.27 * pi / 180), 1, order);
        const std::vector<double> aboutLobe = sh::basis(order, lobe), aboutSun = sh::basis(order, sun),
                                  aboutUp = sh::basis(order, {0, 1, 0});
        environment.coefficient[0][constant] = std::sqrt(4 * pi);
        for (int l = 0; l <= order; ++l) {
            const auto n = std::size_t(l);
            for (int m = -l; m <= l; ++m) {
                const std::size_t i = sh::coefficientIndex(l, m);
                const double dome = 2 * pi * (above[n] - 0.6 * moment[n] + 0.2 * below[n]) * aboutUp[i];
                environment.coefficient[i][cosine] = 2 * pi * moment[n] * aboutLobe[i];
                environment.coefficient[i][sunsky] = dome + 1e5 * 2 * pi * disc[n] * aboutSun[i];
                if (l <= 3) sky.coefficient[i] = glm::dvec3(dome);
            }
        }
    }
    double value(std::size_t which, const std::string& what, std::size_t view) const
    {
        const auto& values = table[names[which]][what];
        return values.is_array() ? values[view].get<double>() : values.get<double>();
    }
};

// Every order of the tables that sh reaches, and the table of errors.
TEST_F(ReferenceRadiance, EveryOrder)
{
    const std::vector<double> f = optics::zonalCoefficients(order, paper);
    sh::Harmonics response = environment;
    sh::convolve(response, {f, f, f});
    // bands[view][l]: the sum of the bands up to l.
    std::vector<std::vector<glm::dvec3>> upTo(views.size());
    parallelFor(0, std::ptrdiff_t(views.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t i = first; i < last; ++i) {
            const std::vector<double> y = sh::basis(order, views[std::size_t(i)]);
            glm::dvec3 sum(0.0);
            for (int l = 0; l <= order; ++l) {
                for (int m = -l; m <= l; ++m) {
                    sum += y[sh::coefficientIndex(l, m)] * response.coefficient[sh::coefficientIndex(l, m)];
                }
                upTo[std::size_t(i)].push_back(sum);
            }
        }
    });
    for (const std::size_t which : {constant, cosine, sunsky}) {
        // The sun's coefficients are 1e5 times the disc's, to the rounding of the cosine of its edge.
        const double tolerance = which == sunsky ? 1e-10 : 1e-12;
        for (const std::size_t l : {3, 8, 16, 32, 64, 128, 256}) {
            for (std::size_t i = 0; i < views.size(); ++i) {
                ASSERT_NEAR(upTo[i][l][int(which)], value(which, fmt::format("order_{}", l), i), tolerance)
                    << names[which] << l;
            }
        }
    }
    // At the highest order what is left is what the table says of it: 2.6e-10 and 3.7e-3 root mean square.
    for (std::size_t i = 0; i < views.size(); ++i) {
        EXPECT_NEAR(upTo[i].back()[int(cosine)], value(cosine, "exact", i), 5e-9);
        EXPECT_NEAR(upTo[i].back()[int(sunsky)], value(sunsky, "exact", i), 0.06);
    }
    // The table's errors are over views of its own, some of which lie beside a rainbow; over the sphere by Parseval.
    const std::vector<glm::dvec3> energy = sh::bandEnergies(response);
    for (const std::size_t which : {cosine, sunsky}) {
        for (const auto& row : table[names[which]]["rms"]) {
            double square = 0.0;
            for (std::size_t l = row[0].get<std::size_t>() + 1; l < energy.size(); ++l) square += energy[l][int(which)];
            EXPECT_NEAR(std::sqrt(square / (4 * pi)) / row[1].get<double>(), 1.0, 0.12) << names[which] << row[0];
        }
    }
    // evaluate() is the same sum.
    const sh::Harmonics low = sh::truncated(response, 64);
    for (std::size_t i = 0; i < views.size(); i += 9) {
        EXPECT_LT(glm::length(sh::evaluate(low, views[i]) - upTo[i][64]), 1e-12);
    }
}

// Wang et al.'s C + 0.7 B, which makes a white world 1.7 times white, and ours, which adds what the order left out.
TEST_F(ReferenceRadiance, BackgroundBoosts)
{
    const std::vector<double> f = optics::zonalCoefficients(3, paper);
    const sh::Harmonics lowPass = sh::truncated(environment, 3);
    sh::Harmonics response = lowPass;
    sh::convolve(response, {f, f, f});
    for (const std::size_t which : {constant, cosine, sunsky}) {
        for (std::size_t i = 0; i < views.size(); ++i) {
            const double drop = sh::evaluate(response, views[i])[int(which)];
            const double behind = value(which, "background", i), low = sh::evaluate(lowPass, views[i])[int(which)];
            ASSERT_NEAR(drop + 0.7 * behind, value(which, "paper_eq2", i), 1e-11) << names[which];
            ASSERT_NEAR(drop + 0.7 * (behind - low), value(which, "add_back", i), 1e-11) << names[which];
        }
    }
    EXPECT_NEAR(value(constant, "paper_eq2", 0), 1.7, 2e-4);
    EXPECT_NEAR(value(constant, "add_back", 0), 1.0, 2e-4);
}

// The sun taken out of order 3 and put through D by bins of a quarter of a degree.
TEST_F(ReferenceRadiance, SunThroughBins)
{
    constexpr int bins = 720;
    std::vector<double> edges;
    for (int i = 0; i <= bins; ++i) edges.push_back(pi * i / bins);
    const std::vector<double> energy = optics::binEnergies(edges, paper);
    std::vector<double> mean;
    for (std::size_t i = 0; i < bins; ++i) {
        mean.push_back(energy[i] / (2 * pi * (std::cos(edges[i]) - std::cos(edges[i + 1]))));
    }
    const std::vector<double> f = optics::zonalCoefficients(3, paper);
    sh::Harmonics response = sky;
    sh::convolve(response, {f, f, f});
    const double sunEnergy = 1e5 * 2 * pi * (1 - std::cos(0.27 * pi / 180));
    for (std::size_t i = 0; i < views.size(); ++i) {
        const double place = std::acos(glm::dot(views[i], sun)) / pi * bins - 0.5;
        const auto k = std::size_t(std::clamp(place, 0.0, bins - 2.0));
        const double t = std::clamp(place - double(k), 0.0, 1.0);
        const double d = (1 - t) * mean[k] + t * mean[k + 1];
        ASSERT_NEAR(sh::evaluate(response, views[i]).g + sunEnergy * d, value(sunsky, "hybrid", i), 1e-9) << i;
    }
}

}  // namespace
}  // namespace virga::environment
