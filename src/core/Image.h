// Images in memory. Top row first, channels interleaved, rows packed unless a view says otherwise. Unless a name says
// otherwise the pixels are scene-linear, premultiplied float32 (docs/conventions.md).
#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace virga {

/// Pixels that somebody else owns: width x height x channels of T, `rowStride` elements from one row to the next.
template <class T>
class ImageView {
public:
    ImageView() = default;
    ImageView(T* data, int width, int height, int channels, std::ptrdiff_t rowStride = 0)
        : data_(data), width_(width), height_(height), channels_(channels),
          rowStride_(rowStride != 0 ? rowStride : std::ptrdiff_t(width) * channels)
    {
    }

    /// A view that may write is also one that may read.
    operator ImageView<const T>() const { return {data_, width_, height_, channels_, rowStride_}; }

    T* data() const { return data_; }
    int width() const { return width_; }
    int height() const { return height_; }
    int channels() const { return channels_; }
    std::ptrdiff_t rowStride() const { return rowStride_; }
    bool empty() const { return width_ == 0 || height_ == 0; }

    T* row(int y) const
    {
        assert(y >= 0 && y < height_);
        return data_ + y * rowStride_;
    }
    T* pixel(int x, int y) const
    {
        assert(x >= 0 && x < width_);
        return row(y) + std::ptrdiff_t(x) * channels_;
    }
    T& at(int x, int y, int channel = 0) const { return pixel(x, y)[channel]; }

private:
    T* data_ = nullptr;
    int width_ = 0, height_ = 0, channels_ = 0;
    std::ptrdiff_t rowStride_ = 0;
};

/// Pixels with an owner.
template <class T>
class Image {
public:
    Image() = default;
    Image(int width, int height, int channels, T fill = T())
        : width_(width), height_(height), channels_(channels),
          pixels_(std::size_t(width) * std::size_t(height) * std::size_t(channels), fill)
    {
    }

    int width() const { return width_; }
    int height() const { return height_; }
    int channels() const { return channels_; }
    bool empty() const { return pixels_.empty(); }
    std::size_t size() const { return pixels_.size(); }

    T* data() { return pixels_.data(); }
    const T* data() const { return pixels_.data(); }
    std::span<T> values() & { return pixels_; }
    std::span<const T> values() const& { return pixels_; }
    void values() const&& = delete;  ///< `for (x : make().values())` would read what is already gone

    T* row(int y) { return view().row(y); }
    const T* row(int y) const { return view().row(y); }
    T* pixel(int x, int y) { return view().pixel(x, y); }
    const T* pixel(int x, int y) const { return view().pixel(x, y); }
    T& at(int x, int y, int channel = 0) { return view().at(x, y, channel); }
    const T& at(int x, int y, int channel = 0) const { return view().at(x, y, channel); }

    ImageView<T> view() { return {pixels_.data(), width_, height_, channels_}; }
    ImageView<const T> view() const { return {pixels_.data(), width_, height_, channels_}; }
    operator ImageView<T>() { return view(); }
    operator ImageView<const T>() const { return view(); }

private:
    int width_ = 0, height_ = 0, channels_ = 0;
    std::vector<T> pixels_;
};

using ImageF = Image<float>;
using ConstImageViewF = ImageView<const float>;

}  // namespace virga
