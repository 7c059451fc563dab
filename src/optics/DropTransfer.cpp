#include "optics/DropTransfer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "core/Error.h"
#include "optics/Fresnel.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;
using Complex = std::complex<double>;

void check(const DropTransferOptions& options)
{
    if (!(options.index > 1.0 && options.index <= 4.0)) {
        throw Error(ErrorCode::InvalidArgument, "refractive index {}: must be over 1 and at most 4", options.index);
    }
    if (options.terms < 0) {
        throw Error(ErrorCode::InvalidArgument, "{} scattering terms: must be 1 or more, or 0 for all", options.terms);
    }
}

/// The reflectances that are followed along the path, each standing for an equal share of the light.
struct Channels {
    std::array<double, 2> reflectance;
    int count;
};

Channels channels(double gamma, const DropTransferOptions& options)
{
    const Fresnel r = fresnel(std::cos(gamma), options.index);
    if (options.model == PathModel::Paper) return {{r.mean(), 0.0}, 1};
    return {{r.s, r.p}, 2};
}

/// Phi_n at incidence gamma.
double pathPower(int n, double gamma, const DropTransferOptions& options)
{
    const Channels c = channels(gamma, options);
    double sum = 0.0;
    for (int i = 0; i < c.count; ++i) {
        const double r = c.reflectance[std::size_t(i)];
        sum += n == 1 ? r : (1.0 - r) * (1.0 - r) * std::pow(r, n - 2);
    }
    return sum / c.count;
}

/// Nodes over gamma in [0, pi/2] for integrands that turn as fast as cos(order * zeta); weights hold sin(2 gamma).
/// gamma = pi/2 (1 - t^2), t in [0, 1]: towards grazing, R goes to 1 and the geometric series has poles close by.
struct IncidenceNodes {
    std::vector<double> gamma, weight;

    explicit IncidenceNodes(int order)
    {
        const GaussLegendre rule(20);
        const int panels = 12 + order / 3;
        for (int panel = 0; panel < panels; ++panel) {
            for (std::size_t i = 0; i < rule.node.size(); ++i) {
                const double t = (panel + 0.5 * (1.0 + rule.node[i])) / panels;
                const double g = 0.5 * pi * (1.0 - t * t);
                gamma.push_back(g);
                weight.push_back(rule.weight[i] * 0.5 / panels * pi * t * std::sin(2.0 * g));
            }
        }
    }
};

/// zeta_n(gamma) and the places where a path turns around or passes through forward or backward.
struct Path {
    int n;
    double index;

    double angle(double gamma) const
    {
        return pi - 2.0 * gamma - (n - 1) * (pi - 2.0 * std::asin(std::sin(gamma) / index));
    }

    /// Incidence of the rainbow ray, where d zeta / d gamma = 0; pi/2 if there is none.
    /// (n - 1) cos gamma = index cos beta (Descartes 1637).
    double turningPoint() const
    {
        const double m = double(n - 1) * double(n - 1);
        const double square = m > 1.0 ? (index * index - 1.0) / (m - 1.0) : 2.0;
        return square < 1.0 ? std::acos(std::sqrt(square)) : 0.5 * pi;
    }

    /// The gamma in [g0, g1], where the angle is monotone, at which it is `target`: bisection on Newton's bracket.
    double invert(double g0, double g1, double target) const
    {
        const bool ascends = angle(g1) > angle(g0);
        double low = g0, high = g1;
        double g = 0.5 * (g0 + g1);
        for (int i = 0; i < 100 && high - low > 1e-16; ++i) {
            const double difference = angle(g) - target;
            (ascends == (difference < 0.0) ? low : high) = g;
            const double slope =
                -2.0 + 2.0 * (n - 1) * std::cos(g) / std::sqrt(index * index - std::sin(g) * std::sin(g));
            const double newton = g - difference / slope;
            const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
            if (std::abs(next - g) < 1e-16) break;
            g = next;
        }
        return g;
    }
};

}  // namespace

std::vector<double> zonalCoefficients(int order, const DropTransferOptions& options)
{
    check(options);
    if (order < 0 || order > 4096) {
        throw Error(ErrorCode::InvalidArgument, "order {} of the drop's transfer function: must be from 0 to 4096",
                    order);
    }
    const std::size_t bands = std::size_t(order) + 1;

    // cosine[j]: integral over gamma of the sum over n of Phi_n cos(j zeta_n) sin(2 gamma).
    std::vector<double> cosine(bands, 0.0);
    const IncidenceNodes nodes(order);
    for (std::size_t i = 0; i < nodes.gamma.size(); ++i) {
        const double gamma = nodes.gamma[i];
        const double beta = std::asin(std::sin(gamma) / options.index);
        const Channels c = channels(gamma, options);
        // e^(i j zeta_1), e^(i j zeta_2), and the turn between two encounters, e^(-i j (pi - 2 beta)).
        const Complex stepOutside = std::polar(1.0, pi - 2.0 * gamma);
        const Complex stepThrough = std::polar(1.0, 2.0 * (beta - gamma));
        const Complex stepInside = -std::polar(1.0, 2.0 * beta);
        Complex outside = 1.0, through = 1.0, inside = 1.0;
        const double share = nodes.weight[i] / c.count;
        for (std::size_t j = 0; j < bands; ++j) {
            double sum = 0.0;
            for (int channel = 0; channel < c.count; ++channel) {
                const double r = c.reflectance[std::size_t(channel)];
                const double t = 1.0 - r;
                sum += r * outside.real();
                if (options.terms == 1) continue;
                // T^2 e^(i j zeta_2) (1 - q^(N-1)) / (1 - q), q = R e^(-i j (pi - 2 beta)).
                const Complex q = r * inside;
                Complex series = 1.0 / (1.0 - q);
                if (options.terms > 1) series *= 1.0 - std::pow(q, options.terms - 1);
                sum += t * t * (through * series).real();
            }
            cosine[j] += share * sum;
            outside *= stepOutside;
            through *= stepThrough;
            inside *= stepInside;
        }
    }

    // P_l(cos x) = sum_k a_k a_(l-k) cos((l - 2k) x), a_k = (2k choose k) / 4^k. Whittaker & Watson, 15.1.
    std::vector<double> a(bands, 1.0);
    for (std::size_t k = 1; k < bands; ++k) a[k] = a[k - 1] * (2.0 * double(k) - 1.0) / (2.0 * double(k));
    std::vector<double> f(bands, 0.0);
    for (std::size_t l = 0; l < bands; ++l) {
        for (std::size_t k = 0; k <= l; ++k) f[l] += a[k] * a[l - k] * cosine[l >= 2 * k ? l - 2 * k : 2 * k - l];
    }
    return f;
}

std::vector<double> energyByPath(int count, const DropTransferOptions& options)
{
    check(options);
    std::vector<double> energy(std::size_t(std::max(count, 0)), 0.0);
    const IncidenceNodes nodes(count);
    for (std::size_t i = 0; i < nodes.gamma.size(); ++i) {
        for (std::size_t n = 0; n < energy.size(); ++n) {
            energy[n] += nodes.weight[i] * pathPower(int(n) + 1, nodes.gamma[i], options);
        }
    }
    return energy;
}

std::vector<double> binEnergies(const std::vector<double>& edges, const DropTransferOptions& options)
{
    check(options);
    if (edges.size() < 2 || !(edges.front() >= 0.0) || !(edges.back() <= pi * (1 + 1e-15)) ||
        std::adjacent_find(edges.begin(), edges.end(), std::greater_equal<>()) != edges.end()) {
        throw Error(ErrorCode::InvalidArgument, "bin edges of the transfer function must ascend from 0 to 180 degrees");
    }
    constexpr int termsForAll = 12;
    const int terms = options.terms == 0 ? termsForAll : options.terms;
    const GaussLegendre rule(5);
    std::vector<double> energy(edges.size() - 1, 0.0);
    double total = 0.0;

    for (int n = 1; n <= terms; ++n) {
        const Path path{n, options.index};
        const double turn = path.turningPoint();
        for (const auto& [g0, g1] : {std::array{0.0, turn}, std::array{turn, 0.5 * pi}}) {
            if (!(g0 < g1)) continue;
            // Cut [g0, g1] wherever the angle, folded into [0, pi], meets a bin's edge.
            const auto [lowest, highest] = std::minmax({path.angle(g0), path.angle(g1)});
            std::vector<double> cuts{g0, g1};
            const auto cutAt = [&](double angle) {
                if (angle > lowest && angle < highest) cuts.push_back(path.invert(g0, g1, angle));
            };
            for (int fold = int(std::floor(lowest / (2 * pi))) - 1; fold <= int(std::ceil(highest / (2 * pi))) + 1;
                 ++fold) {
                cutAt(2 * pi * fold);
                cutAt(2 * pi * fold + pi);
                for (const double edge : edges) {
                    cutAt(2 * pi * fold + edge);
                    cutAt(2 * pi * fold - edge);
                }
            }
            std::sort(cuts.begin(), cuts.end());
            for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
                const double half = 0.5 * (cuts[i + 1] - cuts[i]);
                if (!(half > 0.0)) continue;
                const double centre = 0.5 * (cuts[i + 1] + cuts[i]);
                double sum = 0.0;
                for (std::size_t k = 0; k < rule.node.size(); ++k) {
                    const double gamma = centre + half * rule.node[k];
                    sum += rule.weight[k] * half * std::sin(2.0 * gamma) * pathPower(n, gamma, options);
                }
                total += sum;
                const double folded = std::abs(std::remainder(path.angle(centre), 2 * pi));
                const auto above = std::upper_bound(edges.begin(), edges.end(), folded);
                if (above == edges.begin() || above == edges.end()) continue;
                energy[std::size_t(above - edges.begin()) - 1] += sum;
            }
        }
    }
    if (options.terms == 0) {
        for (std::size_t i = 0; i < energy.size(); ++i) {
            energy[i] += (1.0 - total) * 0.5 * (std::cos(edges[i]) - std::cos(edges[i + 1]));
        }
    }
    return energy;
}

namespace {
constexpr int ringSteps = 720;
}

RingTransfer::RingTransfer(const DropTransferOptions& options) : within_(ringSteps + 1, 0.0)
{
    std::vector<double> edges(ringSteps + 1);
    for (int i = 0; i <= ringSteps; ++i) edges[std::size_t(i)] = pi * i / ringSteps;
    const std::vector<double> energy = binEnergies(edges, options);
    for (std::size_t i = 0; i < energy.size(); ++i) within_[i + 1] = within_[i] + energy[i];
}

double RingTransfer::energyWithin(double theta) const
{
    // Between the table's angles the energy goes as the solid angle, that is, D is constant.
    const double place = std::clamp(theta / pi, 0.0, 1.0) * ringSteps;
    const int i = std::min(int(place), ringSteps - 1);
    const double a = std::cos(pi * i / ringSteps), b = std::cos(pi * (i + 1) / ringSteps);
    const double t = std::clamp((a - std::cos(std::clamp(theta, 0.0, pi))) / (a - b), 0.0, 1.0);
    return within_[std::size_t(i)] + t * (within_[std::size_t(i) + 1] - within_[std::size_t(i)]);
}

double RingTransfer::mean(double theta, double halfWidth) const
{
    assert(halfWidth > 0.0);
    const double from = std::max(theta - halfWidth, 0.0);
    const double to = std::min(theta + halfWidth, pi);
    return (energyWithin(to) - energyWithin(from)) / (2.0 * pi * (std::cos(from) - std::cos(to)));
}

}  // namespace virga::optics
