#pragma once

#include <vector>

namespace virga::particles {

/// Poisson numbers of one mean by inversion: the same u always gives the same number.
class PoissonTable {
public:
    /// mean in [0, 1e5].
    explicit PoissonTable(double mean);
    /// u in [0, 1).
    int operator()(double u) const;

private:
    std::vector<double> cumulative_;  // P(N <= n)
};

}  // namespace virga::particles
