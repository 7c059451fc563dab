#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/Error.h"
#include "optics/DropTransfer.h"
#include "optics/Fresnel.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;
using Json = nlohmann::json;

Json readData(const char* name) { return Json::parse(std::ifstream(std::string(VIRGA_TEST_DATA "/") + name)); }

PathModel modelNamed(const char* name) { return name[1] == 'o' ? PathModel::Polarised : PathModel::Paper; }

TEST(GaussLegendre, IntegratesPolynomialsExactly)
{
    for (const int count : {1, 2, 8, 20, 64}) {
        const GaussLegendre rule(count);
        for (int power = 0; power < 2 * count; power += 2) {
            double sum = 0.0;
            for (int i = 0; i < count; ++i)
                sum += rule.weight[std::size_t(i)] * std::pow(rule.node[std::size_t(i)], power);
            EXPECT_NEAR(sum, 2.0 / (power + 1), 2e-14) << count << " " << power;
        }
    }
}

TEST(DropTransfer, AllLightLeavesTheDrop)
{
    for (const double index : {1.05, 1.331, 1.333, 1.338, std::numbers::sqrt2, 1.52, 2.0, 3.0}) {
        for (const PathModel model : {PathModel::Polarised, PathModel::Paper}) {
            EXPECT_NEAR(zonalCoefficients(8, {.index = index, .model = model})[0], 1.0, 1e-14) << index;
        }
    }
}

TEST(DropTransfer, AgreesWithTheReferenceNumbers)
{
    const Json table = readData("transfer_zonal.json");
    for (const char* name : {"polar", "paper"}) {
        for (const int terms : {0, 9}) {
            const auto f = zonalCoefficients(64, {.model = modelNamed(name), .terms = terms});
            for (std::size_t l = 0; l <= 64; ++l) {
                EXPECT_NEAR(f[l], table[name][terms == 0 ? "terms_all" : "terms_9"][l].get<double>(), 1e-13)
                    << name << " " << terms << " l = " << l;
            }
        }
        std::vector<double> before(13, 0.0);
        for (int n = 1; n <= 9; ++n) {
            const auto f = zonalCoefficients(12, {.model = modelNamed(name), .terms = n});
            for (std::size_t l = 0; l <= 12; ++l) {
                EXPECT_NEAR(f[l] - before[l], table[name]["by_path"][std::size_t(n) - 1][l].get<double>(), 1e-14);
            }
            before = f;
        }
    }
}

/// f_l of one path straight from its definition, with P_l by recurrence and many more nodes than needed.
std::vector<double> directly(int order, double index, int terms)
{
    std::vector<double> f(std::size_t(order) + 1, 0.0);
    const GaussLegendre rule(40);
    const int panels = 200;
    for (int panel = 0; panel < panels; ++panel) {
        for (std::size_t i = 0; i < rule.node.size(); ++i) {
            const double gamma = 0.5 * pi * (panel + 0.5 * (1 + rule.node[i])) / panels;
            const double beta = std::asin(std::sin(gamma) / index);
            const Fresnel r = fresnel(std::cos(gamma), index);
            for (int n = 1; n <= terms; ++n) {
                const auto power = [n](double R) { return n == 1 ? R : (1 - R) * (1 - R) * std::pow(R, n - 2); };
                const double weight =
                    rule.weight[i] * 0.25 * pi / panels * std::sin(2 * gamma) * 0.5 * (power(r.s) + power(r.p));
                const double x = std::cos(pi - 2 * gamma - (n - 1) * (pi - 2 * beta));
                double previous = 0.0, value = 1.0;
                for (std::size_t l = 0; l < f.size(); ++l) {
                    f[l] += weight * value;
                    const double next = ((2.0 * double(l) + 1) * x * value - double(l) * previous) / (double(l) + 1);
                    previous = value;
                    value = next;
                }
            }
        }
    }
    return f;
}

TEST(DropTransfer, OtherIndicesOrdersAndTermsMatchTheDefinition)
{
    for (const double index : {1.331, 1.338, 1.5}) {
        for (const int terms : {1, 2, 3, 7}) {
            const auto expected = directly(256, index, terms);
            const auto f = zonalCoefficients(256, {.index = index, .terms = terms});
            for (std::size_t l = 0; l <= 256; ++l)
                EXPECT_NEAR(f[l], expected[l], 1e-12) << index << " " << terms << " " << l;
        }
    }
}

TEST(DropTransfer, HighOrdersHaveConverged)
{
    // The first 257 of 1025 coefficients use four times the nodes.
    const auto few = zonalCoefficients(256);
    const auto many = zonalCoefficients(1024);
    for (std::size_t l = 0; l <= 256; ++l) EXPECT_NEAR(few[l], many[l], 1e-13) << l;
}

TEST(DropTransfer, EnergyByPath)
{
    const auto energy = energyByPath(200);
    const double published[] = {0.0665, 0.8836, 0.0406, 0.0061, 0.0017, 0.0007};
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(energy[i], published[i], 2e-4) << i;
    for (const double e : energy) sum += e;
    EXPECT_NEAR(sum, 1.0, 2e-8);
}

TEST(DropTransfer, BinEnergiesAgreeWithTheReferenceNumbers)
{
    const Json table = readData("transfer_bins.json");
    std::vector<double> edges(721);
    for (std::size_t i = 0; i <= 720; ++i) edges[i] = pi * double(i) / 720;
    for (const char* name : {"polar", "paper"}) {
        const auto energy = binEnergies(edges, {.model = modelNamed(name), .terms = 9});
        for (std::size_t i = 0; i < table["bins"].size(); ++i) {
            EXPECT_NEAR(energy[table["bins"][i].get<std::size_t>()], table[name][i].get<double>(), 1e-14)
                << name << " " << table["bins"][i];
        }
        const auto all = binEnergies(edges, {.model = modelNamed(name)});
        for (std::size_t i = 0; i < table["bins"].size(); ++i) {
            EXPECT_NEAR(all[table["bins"][i].get<std::size_t>()], table[std::string(name) + "_60"][i].get<double>(),
                        5e-6);
        }
    }
}

TEST(DropTransfer, BinsAndCoefficientsAreOneFunction)
{
    // A bin's energy times the mean of P_l over its solid angle, in fine bins: f_l to the bins' width squared.
    std::vector<double> edges(1441);
    for (std::size_t i = 0; i < edges.size(); ++i) edges[i] = pi * double(i) / 1440;
    const auto energy = binEnergies(edges);
    const auto f = zonalCoefficients(4);
    double sum0 = 0, sum1 = 0, sum2 = 0;
    for (std::size_t i = 0; i < energy.size(); ++i) {
        const double x = 0.5 * (std::cos(edges[i]) + std::cos(edges[i + 1]));
        sum0 += energy[i];
        sum1 += energy[i] * x;
        sum2 += energy[i] * 0.5 * (3 * x * x - 1);
    }
    EXPECT_NEAR(sum0, 1.0, 1e-13);
    EXPECT_NEAR(sum1, f[1], 2e-5);
    EXPECT_NEAR(sum2, f[2], 2e-5);
}

TEST(DropTransfer, RingsAddUpToTheSphereAndShowTheRainbow)
{
    const RingTransfer ring;
    double energy = 0.0;
    for (int i = 0; i < 90; ++i) {
        const double a = pi * i / 90, b = pi * (i + 1) / 90;
        energy += ring.mean(0.5 * (a + b), 0.5 * (b - a)) * 2 * pi * (std::cos(a) - std::cos(b));
    }
    EXPECT_NEAR(energy, 1.0, 1e-12);
    const double degree = pi / 180;
    // D in 2-degree bins, published for n = 1.333.
    EXPECT_NEAR(ring.mean(1 * degree, 1 * degree), 1.294, 2e-3);
    EXPECT_NEAR(ring.mean(11 * degree, 1 * degree), 1.034, 2e-3);
    EXPECT_NEAR(ring.mean(139 * degree, 1 * degree), 0.0782, 5e-4);
    // The darkest part: what the 13th and later encounters would add there is spread over the sphere.
    EXPECT_NEAR(ring.mean(91 * degree, 1 * degree), 0.00230, 5e-5);
    EXPECT_GT(ring.mean(138.2 * degree, 0.25 * degree), 5 * ring.mean(136.5 * degree, 0.25 * degree));
    EXPECT_EQ(ring.energyWithin(0.0), 0.0);
    EXPECT_NEAR(ring.energyWithin(4.0), 1.0, 1e-12);
}

TEST(DropTransfer, RefusesWhatIsNoDrop)
{
    EXPECT_THROW(zonalCoefficients(4, {.index = 1.0}), Error);
    EXPECT_THROW(zonalCoefficients(4, {.index = std::nan("")}), Error);
    EXPECT_THROW(zonalCoefficients(-1), Error);
    EXPECT_THROW(zonalCoefficients(4, {.terms = -1}), Error);
    EXPECT_THROW(binEnergies({0.0, 1.0, 1.0}), Error);
}

}  // namespace
}  // namespace virga::optics
