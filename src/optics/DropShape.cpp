#include "optics/DropShape.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;

constexpr std::size_t rows = 5;
constexpr std::array<double, rows> tableRadius{0.0, 0.5e-3, 1.0e-3, 3.0e-3, 4.5e-3};
constexpr double table[rows][11] = {{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
                                    {-28, -30, -83, -22, -3, 2, 1, 0, 0, 0, 0},
                                    {-134, -118, -385, -100, -5, 17, 6, -1, -3, -1, 1},
                                    {-843, -472, -2040, -240, 299, 168, -21, -73, -20, 25, 24},
                                    {-1328, -403, -2889, -106, 662, 153, -146, -111, 18, 81, 31}};

/// Fritsch & Carlson 1980 through column n of the table (there in units of 1e-4). Flat at a = 0: the pressure that
/// deforms a drop falls faster than its size.
double interpolate(std::size_t n, double a)
{
    std::array<double, rows - 1> step{}, secant{};
    for (std::size_t i = 0; i + 1 < rows; ++i) {
        step[i] = tableRadius[i + 1] - tableRadius[i];
        secant[i] = (table[i + 1][n] - table[i][n]) / step[i];
    }
    std::array<double, rows> slope{};
    slope.back() = secant.back();
    for (std::size_t i = 1; i + 1 < rows; ++i) {
        if (secant[i - 1] * secant[i] <= 0.0) continue;
        const double weight = (step[i - 1] + 2.0 * step[i]) / (3.0 * (step[i - 1] + step[i]));
        slope[i] = secant[i - 1] * secant[i] / (weight * secant[i] + (1.0 - weight) * secant[i - 1]);
    }
    std::size_t i = 0;
    while (i + 2 < rows && a > tableRadius[i + 1]) ++i;
    const double t = std::clamp((a - tableRadius[i]) / step[i], 0.0, 1.0), s = 1.0 - t;
    return 1e-4 * (s * s * (1.0 + 2.0 * t) * table[i][n] + t * t * (1.0 + 2.0 * s) * table[i + 1][n] +
                   step[i] * s * t * (s * slope[i] - t * slope[i + 1]));
}

}  // namespace

DropShape::DropShape(double equivolumeRadius) noexcept : radius_(std::max(equivolumeRadius, 0.0))
{
    for (std::size_t n = 0; n < coefficient_.size(); ++n) coefficient_[n] = interpolate(n, radius_);

    // Volume 2 pi / 3 times the integral of r^3 over cos theta; r^3 is a polynomial of degree 30 in it.
    static const GaussLegendre rule(24);
    double relative = 0.0;
    for (std::size_t i = 0; i < rule.node.size(); ++i) {
        double r = 1.0;
        const double theta = std::acos(rule.node[i]);
        for (std::size_t n = 0; n < coefficient_.size(); ++n) r += coefficient_[n] * std::cos(double(n) * theta);
        relative += 0.5 * rule.weight[i] * r * r * r;
    }
    scale_ = 1.0 / std::cbrt(relative);
    volume_ = 4.0 / 3.0 * pi * radius_ * radius_ * radius_;

    // Extremes of r sin and r cos: a scan, then parabolas through three values, the second on a spot of its own.
    constexpr int steps = 720;
    const auto extreme = [this](auto&& value) {
        int best = 0;
        for (int i = 1; i <= steps; ++i) {
            if (value(pi * i / steps) > value(pi * best / steps)) best = i;
        }
        double at = pi * best / steps, greatest = value(at);
        for (const double h : {pi / steps, 1e-4}) {
            const double before = value(at - h), here = value(at), after = value(at + h);
            const double curvature = before - 2.0 * here + after;
            if (!(curvature < 0.0)) break;
            greatest = here - (after - before) * (after - before) / (8.0 * curvature);
            at -= 0.5 * h * (after - before) / curvature;
        }
        return greatest;
    };
    width_ = 2.0 * extreme([this](double theta) { return radius(theta) * std::sin(theta); });
    height_ = extreme([this](double theta) { return radius(theta) * std::cos(theta); }) +
              extreme([this](double theta) { return -radius(theta) * std::cos(theta); });
}

double DropShape::radius(double theta) const noexcept
{
    double sum = 1.0;
    for (std::size_t n = 0; n < coefficient_.size(); ++n) sum += coefficient_[n] * std::cos(double(n) * theta);
    return radius_ * scale_ * sum;
}

double meanAxisRatio(double diameter) noexcept { return std::min(1.0, 1.03 - 62.0 * diameter); }

}  // namespace virga::optics
