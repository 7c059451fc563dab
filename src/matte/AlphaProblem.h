// What an alpha step solves, entry by entry: the matrix of the slope along the rain, and what the data say of each row
// (RainEquation.h has the equation).
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "matte/RainEquation.h"

namespace virga::matte {

/// Keeps the solve bounded where neither the data nor the cost sees alpha. Far below a bit of 16 in (C - S)^2.
constexpr double alphaRidge = 1e-12;
constexpr int mostAlphaSteps = 500;

/// The matrix of sum (sin dx + cos dy)^2. A column goes along the rain as far as the grid allows: down the picture, or,
/// beyond 45 degrees, across it; the formulas are the same with the axes swapped.
struct AlongRain {
    int columns, rows;
    bool isLevel;                    // columns go across the picture
    std::ptrdiff_t toColumn, toRow;  // steps in a picture of one channel
    double s, c;                     // of D0: across the columns, down them; |s| <= |c|

    AlongRain(int width, int height, double slant)
        : columns(width), rows(height), isLevel(false), toColumn(1), toRow(width), s(std::sin(slant)),
          c(std::cos(slant))
    {
        if (std::abs(s) > std::abs(c)) {
            isLevel = true;
            std::swap(columns, rows);
            std::swap(toColumn, toRow);
            std::swap(s, c);
        }
    }

    std::ptrdiff_t at(int x, int y) const { return x * toColumn + y * toRow; }

    /// Of the squares of differences down column x, >= 0; and of the square of the value at (x, y) itself.
    double coupling(int x) const { return c * (across(x) + c); }
    double own(int x, int y) const
    {
        return across(x) * across(x) + (x > 0 ? s * s : 0.0) + across(x) * c * (double(y + 1 < rows) - double(y > 0));
    }
    /// Between (x, y) and (x + 1, y), which is inside.
    double right(int y) const { return -s * (s + (y + 1 < rows ? c : 0.0)); }
    /// Between (x + 1, y) and (x, y + 1).
    double cross() const { return s * c; }

    double product(const double* v, int x, int y) const
    {
        const double* here = v + at(x, y);
        double sum = own(x, y) * here[0];
        if (y + 1 < rows) sum += coupling(x) * (here[0] - here[toRow]);
        if (y > 0) sum += coupling(x) * (here[0] - here[-toRow]);
        if (x + 1 < columns) {
            sum += right(y) * here[toColumn];
            if (y > 0) sum += cross() * here[toColumn - toRow];
        }
        if (x > 0) {
            sum += right(y) * here[-toColumn];
            if (y + 1 < rows) sum += cross() * here[toRow - toColumn];
        }
        return sum;
    }

private:
    double across(int x) const { return x + 1 < columns ? s : 0.0; }
};

/// A row of a frame and what goes with it.
struct DataRow {
    int width, channels;
    const float *frame, *scene, *trust, *cost;
    std::array<float, 3> color;
    double eta;
};
/// seen: w sum over channels of (C - S)^2, what multiplies alpha^2; pull: w sum of (C - S) (I - S), less the cost.
void askRow(const DataRow& row, float* seen, float* pull);
void askRow(const DataRow& row, double* seen, double* pull);

/// The rows of frame k against a scene. `ones` stands for a trust or a cost that is not given.
class FrameData {
public:
    FrameData(const Footage& footage, std::size_t k, const ImageF& scene, const RainTerms& terms,
              const std::vector<float>& ones)
        : footage_(footage), k_(k), scene_(scene), terms_(terms), ones_(ones)
    {
        assert(scene.channels() == 1 || scene.channels() == 3);
    }

    template <class Real>
    void ask(int y, Real* seen, Real* pull) const
    {
        const DataRow row{scene_.width(),
                          scene_.channels(),
                          footage_.frames[k_].row(y),
                          scene_.row(y),
                          footage_.trust.empty() ? ones_.data() : footage_.trust[k_].row(y),
                          footage_.cost.empty() ? ones_.data() : footage_.cost[k_].row(y),
                          terms_.color,
                          terms_.eta};
        askRow(row, seen, pull);
    }

private:
    const Footage& footage_;
    std::size_t k_;
    const ImageF& scene_;
    const RainTerms& terms_;
    const std::vector<float>& ones_;
};

}  // namespace virga::matte
