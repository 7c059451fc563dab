// Pictures that are made, or put away, a few rows at a time: light that exists while it lies in a cache, between the
// codes of one file and the codes of another.
#pragma once

#include <optional>

#include "core/Image.h"
#include "core/PlanarPicture.h"

namespace virga {

/// Rows that share their chroma in the coarsest format: what is written begins and ends at a multiple of it, or at the
/// picture's end.
constexpr int rowsPerChroma = 4;

/// A picture whose pixels are computed when they are asked for. Any thread may ask, for any rows, any number of times.
class RowSource {
public:
    virtual ~RowSource() = default;
    virtual int width() const = 0;
    virtual int height() const = 0;
    /// Pixels of the rows from `firstRow` on into `rgba`, which has the picture's width and 4 channels.
    virtual void read(int firstRow, ImageView<float> rgba) const = 0;
    /// The codes that read() converts, as long as this lives, where their curve is a power: a device may then do it.
    virtual std::optional<ConstCodedPlanes> codes() const { return std::nullopt; }
};

/// A picture that is filled. Different rows may come from different threads; each row comes once, with all that share
/// its chroma (rowsPerChroma).
class RowSink {
public:
    virtual ~RowSink() = default;
    virtual void write(int firstRow, ConstImageViewF rgba) = 0;
    /// Where write() puts codes, likewise: may be filled in its place.
    virtual std::optional<CodedPlanes> codes() { return std::nullopt; }
};

/// The rows of an image that lives as long as this.
class ImageRows final : public RowSource {
public:
    explicit ImageRows(ConstImageViewF image) : image_(image) {}
    int width() const override { return image_.width(); }
    int height() const override { return image_.height(); }
    void read(int firstRow, ImageView<float> rgba) const override;

private:
    ConstImageViewF image_;
};

/// All of it.
ImageF wholePicture(const RowSource& rows);
/// All of `rgba` into it.
void writePicture(ConstImageViewF rgba, RowSink& rows);

/// Some rows of an image.
template <class T>
ImageView<T> rowsOf(const ImageView<T>& image, int first, int last)
{
    return {image.row(first), image.width(), last - first, image.channels(), image.rowStride()};
}

}  // namespace virga
