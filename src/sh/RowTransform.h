// Fourier sums along the rows of equirectangular maps, to an order that is low beside the rows' length: what
// projection and baking do for every row. Azimuths p as in Harmonics.h.
#pragma once

#include <cstddef>
#include <vector>

#include "core/Image.h"

namespace virga::sh {

/// Sums of f cos(m p) and f sin(m p) over a row's samples, and the way back. A row is folded at the quarters of the
/// circle, where cosines and sines repeat but for their signs; then four matrix products, each a quarter of a row long,
/// give all orders: less work than a Fourier transform of the whole row for the few orders that drops can tell apart.
/// Above foldedOrder, and for widths that are no multiple of 4, by FFT.
class RowTransform {
public:
    static constexpr int foldedOrder = 96;
    static constexpr int channels = 3;
    static constexpr int rowsAtOnce = 8;  ///< fixed, so that results do not depend on how rows are dealt to threads

    /// For each row and channel a run of order + 1 values, m from 0.
    struct Sums {
        Sums(int order, int rows)
            : run(std::size_t(order) + 1), cosine(run * channels * std::size_t(rows)), sine(cosine.size())
        {
        }
        std::size_t at(int m, int row, int channel) const
        {
            return (std::size_t(row) * channels + std::size_t(channel)) * run + std::size_t(m);
        }

        std::size_t run;
        std::vector<double> cosine, sine;
    };

    RowTransform(int order, int width);

    /// rows [firstRow, firstRow + rows) of `map`; rows <= rowsAtOnce.
    Sums forward(ConstImageViewF map, int firstRow, int rows) const;

    /// value = sum over m of cosine cos(m p) + sine sin(m p), into rows of `map` from firstRow on.
    void backward(const Sums& sums, ImageView<float> map, int firstRow, int rows) const;

private:
    bool isFolded() const { return quarter_ > 0; }
    Sums forwardByFft(ConstImageViewF map, int firstRow, int rows) const;
    void backwardByFft(const Sums& sums, ImageView<float> map, int firstRow, int rows) const;

    int order_, width_;
    int quarter_ = 0;  // width / 4 if rows are folded
    // cos(m p) and sin(m p) in the first quarter; [0] even m, [1] odd m; for each sample a run over m.
    std::vector<double> cosine_[2], sine_[2];
};

}  // namespace virga::sh
