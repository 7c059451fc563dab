// Rectangles of pixels in a plane of pixels: what an EXR calls its data window and its display window.
#pragma once

#include <algorithm>

namespace virga {

/// x goes right, y down (docs/conventions.md). Does not throw; the caller sees to it that sums stay in `int`.
struct Window {
    int x = 0, y = 0;  ///< of the first pixel
    int width = 0, height = 0;

    int right() const { return x + width; }  ///< of the first column that is not in it
    int bottom() const { return y + height; }
    bool isEmpty() const { return width <= 0 || height <= 0; }
    bool contains(const Window& other) const
    {
        return other.x >= x && other.y >= y && other.right() <= right() && other.bottom() <= bottom();
    }
    friend bool operator==(const Window&, const Window&) = default;
};

/// The smallest window with both in it.
inline Window united(const Window& a, const Window& b)
{
    const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
    return {x, y, std::max(a.right(), b.right()) - x, std::max(a.bottom(), b.bottom()) - y};
}

/// What lies in both; width and height are 0 if nothing does.
inline Window overlap(const Window& a, const Window& b)
{
    const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
    return {x, y, std::max(0, std::min(a.right(), b.right()) - x), std::max(0, std::min(a.bottom(), b.bottom()) - y)};
}

}  // namespace virga
