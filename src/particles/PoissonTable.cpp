#include "particles/PoissonTable.h"

#include <algorithm>
#include <cmath>

namespace virga::particles {

PoissonTable::PoissonTable(double mean)
{
    const int last = int(mean + 12 * std::sqrt(mean) + 24);  // what lies beyond has less weight than u can express
    double sum = 0;
    int sign = 0;  // std::lgamma would put it into a variable of all threads
    for (int n = 0; n <= last; ++n) {
        sum += mean > 0 ? std::exp(n * std::log(mean) - mean - lgamma_r(n + 1.0, &sign)) : (n == 0 ? 1.0 : 0.0);
        cumulative_.push_back(sum);
    }
}

int PoissonTable::operator()(double u) const
{
    const auto at = std::upper_bound(cumulative_.begin(), cumulative_.end(), u);
    return int(std::min<std::ptrdiff_t>(at - cumulative_.begin(), std::ptrdiff_t(cumulative_.size()) - 1));
}

}  // namespace virga::particles
