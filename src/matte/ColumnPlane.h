// The columns of a picture as the bounded alpha step reads them: the even ones of a row side by side, then the odd
// ones, so that a block is contiguous and so are the columns beside it.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include "matte/AlphaProblem.h"
#include "matte/BoundedLines.h"

namespace virga::matte {

void split(const float* row, int width, float* even, float* odd);
void split(const double* row, int width, double* even, double* odd);
void merge(const float* even, const float* odd, int width, float* row);
void merge(const double* even, const double* odd, int width, float* row);
/// So many tiles of 8 x 8 whose rows become columns, the next one `fromNext` and `toNext` on.
void turnTiles(const float* from, std::ptrdiff_t fromStep, std::ptrdiff_t fromNext, float* to, std::ptrdiff_t toStep,
               std::ptrdiff_t toNext, int tiles);

template <class Real>
class ColumnPlane {
public:
    static constexpr int lanes = LineBlock<Real>::lanes;

    ColumnPlane(const AlongRain& matrix)
        : isLevel_(matrix.isLevel), columns_(matrix.columns), rows_(matrix.rows),
          blocks_(((matrix.columns + 1) / 2 + lanes - 1) / lanes), stride_((2 * blocks_ + 3) * lanes),
          values_(std::size_t(stride_) * std::size_t(rows_ + 2), Real(0))
    {
    }

    /// Blocks of the columns of one parity.
    int blocks() const { return blocks_; }
    std::ptrdiff_t stride() const { return stride_; }
    /// Row y of the columns of a parity; beside and above what is inside there are zeros.
    Real* row(int y, int parity) { return values_.data() + (y + 1) * stride_ + lanes + parity * (blocks_ + 1) * lanes; }
    const Real* row(int y, int parity) const { return const_cast<ColumnPlane*>(this)->row(y, parity); }

    /// So many rows of the picture go in and out together: where lines are level they lie across the plane, and one at
    /// a time would touch a line of the cache for each value.
    static constexpr int rowsTogether = 16;

    /// Rows y to y + count of the picture, one after another, from and to; y a multiple of rowsTogether.
    void put(int y, int count, const Real* values)
    {
        if (!isLevel_) {
            for (int t = 0; t < count; ++t) split(values + t * columns_, columns_, row(y + t, 0), row(y + t, 1));
            return;
        }
        int x = 0;
        if constexpr (std::is_same_v<Real, float>)
            if (count == rowsTogether) {
                for (int parity = 0; parity < 2; ++parity)
                    turnTiles(values + parity * rows_, 2 * rows_, 8, row(0, parity) + y / 2, stride_, 8 * stride_,
                              rows_ / 8);
                x = rows_ / 8 * 8;
            }
        for (; x < rows_; ++x)
            for (int t = 0; t < count; ++t) row(x, t % 2)[(y + t) / 2] = values[t * rows_ + x];
    }
    void get(int y, int count, float* values) const
    {
        if (!isLevel_) {
            for (int t = 0; t < count; ++t) merge(row(y + t, 0), row(y + t, 1), columns_, values + t * columns_);
            return;
        }
        int x = 0;
        if constexpr (std::is_same_v<Real, float>)
            if (count == rowsTogether) {
                for (int parity = 0; parity < 2; ++parity)
                    turnTiles(row(0, parity) + y / 2, stride_, 8 * stride_, values + parity * rows_, 2 * rows_, 8,
                              rows_ / 8);
                x = rows_ / 8 * 8;
            }
        for (; x < rows_; ++x)
            for (int t = 0; t < count; ++t) values[t * rows_ + x] = float(row(x, t % 2)[(y + t) / 2]);
    }

private:
    bool isLevel_;
    int columns_, rows_, blocks_;
    std::ptrdiff_t stride_;
    std::vector<Real> values_;
};

}  // namespace virga::matte
