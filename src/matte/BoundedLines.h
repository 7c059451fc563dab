// Least squares along a line of pixels, each value kept between two bounds: the step for alpha in Wang et al. 2006,
// Eq. (1), where a pixel couples only with its neighbours along the rain's direction.
#pragma once

#include <array>
#include <vector>

namespace virga::matte {

/// Eight lines side by side, so that one instruction serves several. Entry [i][lane]; lines shorter than the block are
/// padded with diagonal 1, link 0, right side 0.
struct LineBlock {
    static constexpr int lanes = 8;
    using Row = std::array<double, lanes>;

    std::vector<Row> diagonal;  // > 0
    std::vector<Row> link;      // of entry i with entry i + 1; the last is not read
    std::vector<Row> rightSide;
    std::vector<Row> value;  // in: where to start; out: the minimiser

    explicit LineBlock(int length = 0) { resize(length); }
    void resize(int length);
    int length() const { return int(value.size()); }

private:
    friend void solveLines(LineBlock&);
    friend void solveLines(LineBlock&, double, double);
    std::vector<Row> factor_, reduced_, trial_;
};

/// Minimises x'Ax/2 - b'x with A tridiagonal, symmetric and positive definite, exactly (Thomas' elimination).
void solveLines(LineBlock& block);

/// The same with low <= x <= high, exactly: primal-dual active sets (Hintermueller, Ito & Kunisch 2003) from those that
/// `value` starts with, which end after few eliminations; where they would cycle, projected Gauss-Seidel sweeps, which
/// never raise the sum. `value` must start within the bounds.
void solveLines(LineBlock& block, double low, double high);

}  // namespace virga::matte
