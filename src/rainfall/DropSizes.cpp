#include "rainfall/DropSizes.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/Error.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::rainfall {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double waterDensity = 1000.0;  // [kg/m^3]
constexpr double mm_h_per_m_s = 3.6e6;

/// Integral of t^j exp(-rate t) over [0, length]: the lower incomplete gamma function, by whichever of its two sums has
/// no cancellation.
double incompleteGamma(int j, double rate, double length)
{
    const double x = rate * length;
    if (x < j + 2.0) {
        // length^(j+1) e^-x sum_i x^i / ((j+1) ... (j+1+i)); all terms positive.
        double term = 1.0 / (j + 1);
        double sum = term;
        for (int i = 1; term > 1e-17 * sum; ++i) {
            term *= x / (j + 1 + i);
            sum += term;
        }
        return std::pow(length, j + 1) * std::exp(-x) * sum;
    }
    // j!/rate^(j+1) (1 - e^-x sum_{i <= j} x^i / i!); the bracket is over 1/2 here.
    double term = 1.0;
    double sum = 1.0;
    double factorial = 1.0;
    for (int i = 1; i <= j; ++i) {
        term *= x / i;
        sum += term;
        factorial *= i;
    }
    return factorial * std::pow(rate, -(j + 1)) * (1.0 - std::exp(-x) * sum);
}

// Gauss-Legendre on [-1, 1], 10 points.
constexpr std::array<double, 5> gaussNode{0.14887433898163121, 0.43339539412924719, 0.67940956829902441,
                                          0.86506336668898451, 0.97390652851717172};
constexpr std::array<double, 5> gaussWeight{0.29552422471475287, 0.26926671930999636, 0.21908636251598204,
                                            0.14945134915058059, 0.06667134430868814};

}  // namespace

DropSizes::DropSizes(double rate_mm_h, double sizeMultiplier)
    : rate_(rate_mm_h), sizeMultiplier_(sizeMultiplier), largestDiameter_(breakUpDiameter), slope_(0), intercept_(0)
{
    if (!(rate_mm_h >= 0.0 && rate_mm_h <= 1e6)) {
        throw Error(ErrorCode::InvalidArgument, "rain rate {} mm/h: must be from 0 to 1000000", rate_mm_h);
    }
    if (!(sizeMultiplier >= 0.01 && sizeMultiplier <= 100.0)) {
        throw Error(ErrorCode::InvalidArgument, "drop size multiplier {}: must be from 0.01 to 100", sizeMultiplier);
    }
    slope_ = 4.1e3 * std::pow(std::max(rate_mm_h, 1e-6), -0.21);
    if (rate_mm_h > 0.0) {
        intercept_ = 1.0;
        intercept_ = rate_mm_h / impliedRate_mm_h();
    }
    // N'(D) = N(D / s) / s is again an exponential.
    slope_ /= sizeMultiplier;
    intercept_ /= sizeMultiplier;
    largestDiameter_ *= sizeMultiplier;
}

DropSizes DropSizes::marshallPalmer(double rate_mm_h)
{
    DropSizes sizes(rate_mm_h);
    sizes.largestDiameter_ = 60.0 / sizes.slope_;
    if (!sizes.empty()) sizes.intercept_ = 8e6;
    return sizes;
}

double DropSizes::density(double diameter) const
{
    if (!(diameter >= 0.0 && diameter <= largestDiameter_)) return 0.0;
    return intercept_ * std::exp(-slope_ * diameter);
}

double DropSizes::moment(int k, double d0, double d1) const
{
    assert(k >= 0 && k <= 12);
    d0 = std::max(d0, 0.0);
    d1 = std::min(d1, largestDiameter_);
    if (!(d0 < d1)) return 0.0;
    // D = d0 + t: e^(-Lambda d0) times the integral of (d0 + t)^k e^(-Lambda t), by the binomial theorem. No term is
    // negative, so narrow intervals keep every digit.
    double sum = 0.0;
    double binomial = 1.0;
    for (int j = k; j >= 0; --j) {
        if (d0 > 0.0 || j == k) {
            sum += binomial * std::pow(d0, k - j) * incompleteGamma(j, slope_, d1 - d0);
        }
        binomial *= double(j) / (k - j + 1);
    }
    return intercept_ * std::exp(-slope_ * d0) * sum;
}

double DropSizes::sampleDiameter(double u, double d0, double d1) const
{
    d0 = std::max(d0, 0.0);
    d1 = std::min(d1, largestDiameter_);
    if (!(d0 < d1)) return d0;
    const double share = -std::expm1(-slope_ * (d1 - d0));
    return std::clamp(d0 - std::log1p(-u * share) / slope_, d0, d1);
}

double DropSizes::medianVolumeDiameter() const
{
    const double half = 0.5 * moment(3);
    double low = 0.0, high = largestDiameter_;
    if (empty()) return low;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (moment(3, 0.0, middle) < half ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

double DropSizes::liquidWater(double d0, double d1) const { return waterDensity * pi / 6.0 * moment(3, d0, d1); }

double DropSizes::extinction(double efficiency, double d0, double d1) const
{
    return efficiency * pi / 4.0 * moment(2, d0, d1);
}

double DropSizes::integrate(const std::function<double(double diameter)>& f, double d0, double d1) const
{
    d0 = std::max(d0, 0.0);
    d1 = std::min(d1, largestDiameter_);
    // Pieces end at multiples of 0.1 mm, which hold all points of Gunn and Kinzer's table, and are no longer than two
    // e-foldings of N(D). Beyond the table nothing happens that longer pieces would miss.
    constexpr double grid = 1e-4;
    double sum = 0.0;
    for (double start = d0; start < d1;) {
        const double step = start < 8e-3 ? grid : 4 * grid;
        double end = std::min(d1, (std::floor(start / step + 1e-9) + 1.0) * step);
        if (d1 - end < 1e-9 * grid) end = d1;
        const int parts = std::max(1, int(std::ceil(0.5 * slope_ * (end - start))));
        const double half = 0.5 * (end - start) / parts;
        for (int part = 0; part < parts; ++part) {
            const double centre = start + (2 * part + 1) * half;
            for (std::size_t i = 0; i < gaussNode.size(); ++i) {
                for (const double side : {-1.0, 1.0}) {
                    const double diameter = centre + side * half * gaussNode[i];
                    sum += half * gaussWeight[i] * f(diameter) * std::exp(-slope_ * diameter);
                }
            }
        }
        start = end;
    }
    return intercept_ * sum;
}

double DropSizes::impactsPerAreaAndTime(double d0, double d1) const { return integrate(terminalSpeed, d0, d1); }

double DropSizes::impliedRate_mm_h(double d0, double d1) const
{
    const auto waterColumn = [](double diameter) {
        return pi / 6.0 * diameter * diameter * diameter * terminalSpeed(diameter);
    };
    return mm_h_per_m_s * integrate(waterColumn, d0, d1);
}

}  // namespace virga::rainfall
