#include "optics/DropTransfer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/Error.h"
#include "optics/Fresnel.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::size_t panelNodes = 20;

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
        const GaussLegendre rule(panelNodes);
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

/// A unit vector for each node of a panel, turned by a fixed angle each step: e^(i j angle), j = 0, 1, 2 ...
struct Rotors {
    std::array<double, panelNodes> re, im, stepRe, stepIm;

    void set(std::size_t i, double angle)
    {
        re[i] = 1.0;
        im[i] = 0.0;
        stepRe[i] = std::cos(angle);
        stepIm[i] = std::sin(angle);
    }
    void step()
    {
        for (std::size_t i = 0; i < panelNodes; ++i) {
            const double turned = re[i] * stepRe[i] - im[i] * stepIm[i];
            im[i] = re[i] * stepIm[i] + im[i] * stepRe[i];
            re[i] = turned;
        }
    }
};

/// Sum over the nodes of a panel of weight times the sum over n = 1 to N of Phi_n cos(j zeta_n), j = 0, 1, 2 ... The
/// latter is the real part of
///   R e^(i j zeta_1) + T^2 e^(i j zeta_2) (1 - q^(N-1)) / (1 - q),   q = R e^(-i j (pi - 2 beta)).
/// Loops over nodes in real numbers, which compilers vectorise.
class SeriesPanel {
public:
    SeriesPanel(const IncidenceNodes& nodes, std::size_t first, const DropTransferOptions& options)
        : terms_(options.terms)
    {
        for (std::size_t i = 0; i < panelNodes; ++i) {
            const double gamma = nodes.gamma[first + i];
            const double beta = std::asin(std::sin(gamma) / options.index);
            outside_.set(i, pi - 2.0 * gamma);
            through_.set(i, 2.0 * (beta - gamma));
            inside_.set(i, 2.0 * beta - pi);
            rest_.set(i, (terms_ - 1) * (2.0 * beta - pi));
            const Channels c = channels(gamma, options);
            channelCount_ = std::size_t(c.count);
            reflected_[i] = 0.0;
            for (std::size_t k = 0; k < channelCount_; ++k) {
                const double r = c.reflectance[k], share = nodes.weight[first + i] / c.count;
                reflected_[i] += share * r;
                reflectance_[k][i] = r;
                transmitted_[k][i] = share * (1.0 - r) * (1.0 - r);
                left_[k][i] = terms_ > 1 ? std::pow(r, terms_ - 1) : 0.0;
            }
        }
    }

    double next()
    {
        std::array<double, panelNodes> sum;
        for (std::size_t i = 0; i < panelNodes; ++i) sum[i] = reflected_[i] * outside_.re[i];
        outside_.step();
        if (terms_ != 1) {
            for (std::size_t k = 0; k < channelCount_; ++k) addSeries(k, sum);
            through_.step();
            inside_.step();
            if (terms_ > 1) rest_.step();
        }
        double total = 0.0;
        for (const double s : sum) total += s;
        return total;
    }

private:
    void addSeries(std::size_t channel, std::array<double, panelNodes>& sum) const
    {
        for (std::size_t i = 0; i < panelNodes; ++i) {
            const double r = reflectance_[channel][i], left = left_[channel][i];
            // through (1 - q^(N-1)) times the conjugate of 1 - q, over |1 - q|^2 in a form that keeps its digits.
            const double a = 1.0 - left * rest_.re[i], b = -left * rest_.im[i];
            const double re = through_.re[i] * a - through_.im[i] * b;
            const double im = through_.re[i] * b + through_.im[i] * a;
            const double t = 1.0 - r;
            const double square = t * t + 2.0 * r * (1.0 - inside_.re[i]);
            sum[i] += transmitted_[channel][i] * (re * (1.0 - r * inside_.re[i]) - im * r * inside_.im[i]) / square;
        }
    }

    int terms_;
    std::size_t channelCount_ = 0;
    Rotors outside_, through_, inside_, rest_;  // zeta_1, zeta_2, the turn between two encounters, N - 1 of these
    std::array<double, panelNodes> reflected_;
    std::array<std::array<double, panelNodes>, 2> reflectance_{}, transmitted_{}, left_{};  // R, T^2, R^(N-1)
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

    /// The incidence before which R^(n - 2) < `least`, for s and so for p.
    double darkBefore(double least) const
    {
        double low = 0.0, high = 0.5 * pi;
        const auto isDark = [&](double gamma) {
            return (n - 2) * std::log(fresnel(std::cos(gamma), index).s) < std::log(least);
        };
        if (n <= 2 || !isDark(low)) return low;
        for (int i = 0; i < 40; ++i) {
            const double middle = 0.5 * (low + high);
            (isDark(middle) ? low : high) = middle;
        }
        return low;
    }

    /// The gamma in [g0, g1], where the angle is monotone, at which it is `target`: Newton from `guess`, and bisection
    /// where that leaves the bracket.
    double invert(double g0, double g1, double target, double guess) const
    {
        const bool ascends = angle(g1) > angle(g0);
        double low = g0, high = g1;
        double g = guess;
        for (int i = 0; i < 100; ++i) {
            const double difference = angle(g) - target;
            (ascends == (difference < 0.0) ? low : high) = g;
            const double newton = g - difference / slope(g);
            const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
            if (std::abs(next - g) < 3e-16 || high - low < 3e-16) return next;
            g = next;
        }
        return g;
    }

    double slope(double gamma) const  ///< d zeta / d gamma
    {
        const double sine = std::sin(gamma);
        return -2.0 + 2.0 * (n - 1) * std::cos(gamma) / std::sqrt(index * index - sine * sine);
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

    // cosine[j]: integral over gamma of the sum over n of Phi_n cos(j zeta_n) sin(2 gamma), a panel of nodes at a time.
    std::vector<double> cosine(bands, 0.0);
    const IncidenceNodes nodes(order);
    for (std::size_t first = 0; first < nodes.gamma.size(); first += panelNodes) {
        SeriesPanel panel(nodes, first, options);
        for (double& sum : cosine) sum += panel.next();
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

PathEnergies energyByPath(int count, const DropTransferOptions& options)
{
    check(options);
    if (count < 1 || count > maxPathEnergies) {
        throw Error(ErrorCode::InvalidArgument, "{} paths through the drop: must be from 1 to {}", count,
                    maxPathEnergies);
    }
    PathEnergies result{std::vector<double>(std::size_t(count), 0.0), 0.0};
    const IncidenceNodes nodes(int(6.0 * std::sqrt(count)));  // R^n is as narrow as 1 / sqrt(n) there
    for (std::size_t i = 0; i < nodes.gamma.size(); ++i) {
        const Channels c = channels(nodes.gamma[i], options);
        for (int k = 0; k < c.count; ++k) {
            const double r = c.reflectance[std::size_t(k)], share = nodes.weight[i] / c.count;
            result.share[0] += share * r;
            double inside = share * (1.0 - r);  // what the paths so far have left in the drop
            for (std::size_t n = 1; n < result.share.size(); ++n) {
                result.share[n] += inside * (1.0 - r);
                inside *= r;
            }
            result.beyond += inside;
        }
    }
    return result;
}

std::vector<double> binEnergies(const std::vector<double>& edges, const DropTransferOptions& options)
{
    check(options);
    if (edges.size() < 2 || !(edges.front() >= 0.0) || !(edges.back() <= pi * (1 + 1e-15)) ||
        std::adjacent_find(edges.begin(), edges.end(), std::greater_equal<>()) != edges.end()) {
        throw Error(ErrorCode::InvalidArgument, "bin edges of the transfer function must ascend from 0 to 180 degrees");
    }
    const int terms = options.terms == 0 ? binTermsForAll : options.terms;
    // Long paths are followed near grazing incidence, where they have light. With a rest to spread, it takes the faint.
    const double unseen = options.terms == 0 ? 1e-12 : 1e-18;
    const GaussLegendre rule(5);
    std::vector<double> energy(edges.size() - 1, 0.0);
    double total = 0.0;
    for (int n = 1; n <= terms; ++n) {
        double ofPath = 0.0;
        const Path path{n, options.index};
        const double dark = path.darkBefore(unseen);
        const double turn = std::max(path.turningPoint(), dark);
        // Five nodes suffice for Fresnel's laws over 0.02 rad, and for R^n, which dies away from grazing as
        // exp(-n K (pi/2 - gamma)), K about 5, over 0.1/n.
        const double longest = std::min(0.02, 0.1 / n);
        for (const auto& [g0, g1] : {std::array{dark, turn}, std::array{turn, 0.5 * pi}}) {
            if (!(g0 < g1)) continue;
            // Cut [g0, g1] wherever the angle, folded into [0, pi], meets a bin's edge.
            const auto [lowest, highest] = std::minmax({path.angle(g0), path.angle(g1)});
            std::vector<double> angles;
            const auto addAngle = [&, from = lowest, to = highest](double angle) {
                if (angle > from && angle < to) angles.push_back(angle);
            };
            for (int fold = int(std::floor(lowest / (2 * pi))); fold <= int(std::ceil(highest / (2 * pi))); ++fold) {
                addAngle(2 * pi * fold);
                addAngle(2 * pi * fold - pi);
                for (const double edge : edges) {
                    addAngle(2 * pi * fold + edge);
                    addAngle(2 * pi * fold - edge);
                }
            }
            std::sort(angles.begin(), angles.end());
            if (path.angle(g0) > path.angle(g1)) std::reverse(angles.begin(), angles.end());
            std::vector<double> cuts{g0};
            for (const double angle : angles)
                cuts.push_back(std::max(cuts.back(), path.invert(g0, g1, angle, cuts.back())));
            cuts.push_back(g1);
            for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
                if (!(cuts[i] < cuts[i + 1])) continue;
                const int pieces = int(std::ceil((cuts[i + 1] - cuts[i]) / longest));
                const double half = 0.5 * (cuts[i + 1] - cuts[i]) / pieces;
                double sum = 0.0;
                for (int piece = 0; piece < pieces; ++piece) {
                    const double centre = cuts[i] + (2 * piece + 1) * half;
                    for (std::size_t k = 0; k < rule.node.size(); ++k) {
                        const double gamma = centre + half * rule.node[k];
                        sum += rule.weight[k] * half * std::sin(2.0 * gamma) * pathPower(n, gamma, options);
                    }
                }
                ofPath += sum;
                const double folded = std::abs(std::remainder(path.angle(0.5 * (cuts[i] + cuts[i + 1])), 2 * pi));
                const auto above = std::upper_bound(edges.begin(), edges.end(), folded);
                if (above == edges.begin() || above == edges.end()) continue;
                energy[std::size_t(above - edges.begin()) - 1] += sum;
            }
        }
        total += ofPath;
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
