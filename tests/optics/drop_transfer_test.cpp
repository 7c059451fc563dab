#include <gtest/gtest.h>

#include <array>
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
        std::vector<double> before(33, 0.0);
        for (int n = 1; n <= 9; ++n) {
            const auto f = zonalCoefficients(32, {.model = modelNamed(name), .terms = n});
            for (std::size_t l = 0; l <= 32; ++l) {
                EXPECT_NEAR(f[l] - before[l], table[name]["by_path"][std::size_t(n) - 1][l].get<double>(), 1e-14);
            }
            before = f;
        }
    }
}

TEST(DropTransfer, OtherIndicesOrdersAndTermsAgreeWithTheReferenceNumbers)
{
    const Json others = readData("transfer_zonal.json")["others"];
    ASSERT_EQ(others.size(), 11u);
    for (const Json& other : others) {
        const DropTransferOptions options{.index = other["index"],
                                          .model = modelNamed(other["model"].get<std::string>().c_str()),
                                          .terms = other["terms"]};
        const auto f = zonalCoefficients(other["order"], options);
        for (std::size_t i = 0; i < other["l"].size(); ++i) {
            const std::size_t l = other["l"][i];
            EXPECT_NEAR(f[l], other["f"][i].get<double>(), 5e-13) << options.index << " l = " << l;
        }
        const PathEnergies energy = energyByPath(int(other["energy"].size()), options);
        for (std::size_t i = 0; i < energy.share.size(); ++i)
            EXPECT_NEAR(energy.share[i], other["energy"][i].get<double>(), 1e-14) << options.index << " path " << i + 1;
    }
}

/// D(theta) of Wang et al.'s Eq. (10), first nine terms: the power that leaves into d theta over the solid angle, which
/// is infinite wherever d zeta / d gamma or sin theta is 0.
double pointwise(double theta, double index)
{
    double sum = 0.0;
    for (int n = 1; n <= 9; ++n) {
        const auto angle = [&](double g) { return pi - 2 * g - (n - 1) * (pi - 2 * std::asin(std::sin(g) / index)); };
        const double m = double(n - 1) * (n - 1);
        const double square = n > 2 ? (index * index - 1) / (m - 1) : 2.0;
        const double turn = square < 1.0 ? std::acos(std::sqrt(square)) : 0.5 * pi;
        for (int target = -4; target < 4; ++target) {
            for (const double goal : {2 * pi * target + theta, 2 * pi * target - theta}) {
                for (const auto& [from, to] : {std::array{0.0, turn}, std::array{turn, 0.5 * pi}}) {
                    double a = from, b = to;
                    const bool rises = angle(b) > angle(a);
                    if (!(a < b) || (angle(a) < goal) != rises || (angle(b) < goal) == rises) continue;
                    for (int i = 0; i < 60; ++i) {
                        const double middle = 0.5 * (a + b);
                        ((angle(middle) < goal) == rises ? a : b) = middle;
                    }
                    const double r = fresnel(std::cos(a), index).mean();
                    const double power = n == 1 ? r : (1 - r) * (1 - r) * std::pow(r, n - 2);
                    const double slope =
                        -2 + 2 * (n - 1) * std::cos(a) / std::sqrt(index * index - std::sin(a) * std::sin(a));
                    sum += power * std::sin(2 * a) / std::abs(slope) / (2 * pi * std::sin(theta));
                }
            }
        }
    }
    return sum;
}

TEST(DropTransfer, SamplingPointwiseIsOffAsFarAsTheReferenceSays)
{
    const auto exact = zonalCoefficients(3, {.model = PathModel::Paper, .terms = 9});
    const Json rows = readData("transfer_zonal.json")["pointwise"];
    ASSERT_EQ(rows.size(), 4u);
    for (const Json& row : rows) {
        const int nodes = row["nodes"];
        if (nodes > 1000) continue;  // more of the same, and slow
        std::array<double, 4> f{};
        for (int i = 0; i < nodes; ++i) {
            const double theta = pi * (i + 0.5) / nodes, x = std::cos(theta);
            const double energy = pointwise(theta, 1.333) * 2 * pi * std::sin(theta) * pi / nodes;
            const double legendre[] = {1.0, x, 0.5 * (3 * x * x - 1), 0.5 * (5 * x * x - 3) * x};
            for (std::size_t l = 0; l < 4; ++l) f[l] += energy * legendre[l];
        }
        for (std::size_t l = 0; l < 4; ++l)
            EXPECT_NEAR(f[l] - exact[l], row["error"][l].get<double>(), 1e-9) << nodes << " nodes, l = " << l;
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
    const Json table = readData("transfer_zonal.json");
    for (const char* name : {"polar", "paper"}) {
        const PathEnergies nine = energyByPath(9, {.model = modelNamed(name)});
        double first = 0.0;
        for (std::size_t n = 0; n < 9; ++n)
            EXPECT_NEAR(first += nine.share[n], table[name]["energy_of_first"][n].get<double>(), 2e-15) << name;
        EXPECT_NEAR(first + nine.beyond, 1.0, 1e-15);
    }
    for (const double index : {1.1, 1.333, 2.4}) {
        const PathEnergies many = energyByPath(maxPathEnergies, {.index = index});
        double sum = many.beyond;
        for (std::size_t n = 1; n < many.share.size(); ++n) {
            EXPECT_GT(many.share[n], 0.0);
            if (n > 1) {
                EXPECT_LT(many.share[n], many.share[n - 1]);
            }
            sum += many.share[n];
        }
        EXPECT_NEAR(sum + many.share[0], 1.0, 1e-14);
        // Near grazing incidence what is left falls as n^-3.
        const double before = energyByPath(maxPathEnergies / 2, {.index = index}).beyond;
        EXPECT_NEAR(before / many.beyond, 8.0, 0.1) << index;
    }
}

TEST(DropTransfer, BinEnergiesAgreeWithTheReferenceNumbers)
{
    const Json table = readData("transfer_bins.json");
    std::vector<double> edges(721);
    for (std::size_t i = 0; i <= 720; ++i) edges[i] = pi * double(i) / 720;
    for (const char* name : {"polar", "paper"}) {
        const auto nine = binEnergies(edges, {.model = modelNamed(name), .terms = 9});
        const auto sixty = binEnergies(edges, {.model = modelNamed(name), .terms = 60});
        const auto all = binEnergies(edges, {.model = modelNamed(name)});
        double sum = 0.0;
        for (const double energy : all) sum += energy;
        EXPECT_NEAR(sum, 1.0, 1e-14);
        for (std::size_t i = 0; i < table["bins"].size(); ++i) {
            const std::size_t bin = table["bins"][i];
            EXPECT_NEAR(nine[bin], table[name][i].get<double>(), 2e-15) << name << " " << bin;
            const double reference = table[std::string(name) + "_60"][i];
            EXPECT_NEAR(sixty[bin], reference, 2e-15) << name << " " << bin;
            // Paths beyond the 60th have 6e-7 of the light.
            EXPECT_GE(all[bin], reference);
            EXPECT_LT(all[bin], reference + 5e-8);
        }
    }
}

TEST(DropTransfer, WideBinsAreAsExactAsNarrowOnes)
{
    std::vector<double> fine(181);
    for (std::size_t i = 0; i <= 180; ++i) fine[i] = pi * double(i) / 180;
    for (const double index : {1.05, 1.333, 2.4}) {
        for (const int terms : {1, 3, 30, 0}) {
            const DropTransferOptions options{.index = index, .terms = terms};
            const auto narrow = binEnergies(fine, options);
            const auto wide = binEnergies({0.0, fine[77], pi}, options);
            double ahead = 0.0, behind = 0.0;
            for (std::size_t i = 0; i < 180; ++i) (i < 77 ? ahead : behind) += narrow[i];
            EXPECT_NEAR(wide[0], ahead, 3e-14) << index << " " << terms;
            EXPECT_NEAR(wide[1], behind, 3e-14) << index << " " << terms;
            EXPECT_NEAR(ahead + behind, zonalCoefficients(0, options)[0], 3e-14) << index << " " << terms;
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
    EXPECT_THROW(energyByPath(0), Error);
    EXPECT_THROW(energyByPath(maxPathEnergies + 1), Error);
}

}  // namespace
}  // namespace virga::optics
