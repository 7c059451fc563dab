// Least squares along a line of pixels, each value kept between two bounds: the step for alpha in Wang et al. 2006,
// Eq. (1), where a pixel couples only with its neighbours along the rain's direction.
#pragma once

#include <array>
#include <vector>

namespace virga::matte {

/// Lines side by side, so that one instruction serves several. For each lane a sum over the line's entries i,
///
///   sum_i own x_i^2 / 2  +  sum_i coupling (x_i - x_i+1)^2 / 2  -  sum_i b x_i,
///
/// written so, and not as a matrix, because float then keeps what a pixel says of itself beside any coupling. Entry
/// [i][lane]; lines shorter than the block are padded with own 1, b 0. Real is float or double.
template <class Real>
struct LineBlock {
    static constexpr int lanes = 64 / int(sizeof(Real));
    struct alignas(64) Row : std::array<Real, std::size_t(lanes)> {};

    Row coupling{};          // >= 0, the same all along a line
    std::vector<Row> own;    // > 0; less at the ends, as far as the sum stays convex
    std::vector<Row> pull;   // b
    std::vector<Row> value;  // in: where to start; out: the minimiser

    explicit LineBlock(int length = 0) { resize(length); }
    void resize(int length);
    int length() const { return int(value.size()); }

    std::vector<Row> factor, reduced, trial;  // the solver's own
};

/// The minimiser, exactly (Thomas' elimination).
template <class Real>
void solveLines(LineBlock<Real>& block);

/// The same with low <= x <= high, exactly: primal-dual active sets (Hintermueller, Ito & Kunisch 2003) from those that
/// `value` starts with, which end after few eliminations; where they would cycle, projected Gauss-Seidel sweeps, which
/// never raise the sum. `value` must start within the bounds. slack > 0 ends earlier: an entry may lie by that much
/// beyond its bound, and is put there, before the sets are changed for it.
template <class Real>
void solveLines(LineBlock<Real>& block, Real low, Real high, Real slack = 0);

}  // namespace virga::matte
