// Statistics with stated odds. Seeds are fixed, so a test passes or fails once and for all; the odds say how likely it
// was, before anybody looked, that correct code fails.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace virga::test {

/// Upper quantile of the standard normal that the suites use: a statistic exceeds it by chance once in 10,000 times.
inline constexpr double kNormal1e4 = 3.719;

/// The value that chi-square of `freedom` degrees exceeds by chance with the odds that the standard normal exceeds
/// `normal`. Wilson and Hilferty 1931, good to 1 % from 5 degrees on.
inline double chiSquareLimit(double freedom, double normal = kNormal1e4)
{
    const double a = 2.0 / (9.0 * freedom);
    return freedom * std::pow(1 - a + normal * std::sqrt(a), 3);
}

/// Pearson's statistic of counts against expected counts; neighbouring bins are joined until 8 are expected in each.
struct ChiSquare {
    double statistic = 0;
    int bins = 0;

    template <class Counts>
    ChiSquare(const Counts& seen, const std::vector<double>& expected)
    {
        double s = 0, e = 0;
        for (std::size_t i = 0; i < expected.size(); ++i) {
            s += double(seen[i]);
            e += expected[i];
            double rest = 0;
            for (std::size_t k = i + 1; k < expected.size(); ++k) rest += expected[k];
            if (e < 8 || (rest < 8 && i + 1 < expected.size())) continue;
            statistic += (s - e) * (s - e) / e;
            ++bins;
            s = e = 0;
        }
    }
    double limit(double normal = kNormal1e4) const { return chiSquareLimit(bins - 1, normal); }
};

}  // namespace virga::test
