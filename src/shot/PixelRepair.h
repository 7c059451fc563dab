#pragma once

#include <atomic>
#include <cstddef>
#include <memory>

#include "core/PictureRows.h"

namespace virga::shot {

/// Replaces NaN (by 0) and infinities (+: 65504, -: 0) of RGBA pixels, which blur and fog would spread over the
/// picture. Returns how many, for the report.
std::size_t repairPixels(ImageF& image);
std::size_t repairRows(ImageView<float> rows);  ///< the same, on this thread

/// The rows of another, repaired.
class RepairedRows final : public RowSource {
public:
    /// repaired: grows with every value that is repaired in a row that is asked for; must outlive it.
    RepairedRows(std::shared_ptr<const RowSource> rows, std::atomic<std::size_t>& repaired)
        : rows_(std::move(rows)), repaired_(repaired)
    {
    }

    int width() const override { return rows_->width(); }
    int height() const override { return rows_->height(); }
    void read(int firstRow, ImageView<float> rgba) const override
    {
        rows_->read(firstRow, rgba);
        if (const std::size_t count = repairRows(rgba); count > 0) repaired_ += count;
    }

    /// No code stands for anything but a number.
    std::optional<ConstCodedPlanes> codes() const override { return rows_->codes(); }

private:
    std::shared_ptr<const RowSource> rows_;
    std::atomic<std::size_t>& repaired_;
};

}  // namespace virga::shot
