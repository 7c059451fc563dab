// Reading pictures of one channel at and between their pixels, whose centres are at integers here. In a header, because
// it is what the alignment does all day.
#pragma once

#include <array>
#include <cstddef>

#include "core/Image.h"

namespace virga::matte::alignment {

/// Weights of the four pixels round a place that is 0 <= t < 1 past the second: Keys 1981, a = -1/2 (Catmull-Rom).
inline std::array<float, 4> cubicWeights(float t)
{
    return {t * (-0.5f + t * (1.0f - 0.5f * t)), 1.0f + t * t * (-2.5f + 1.5f * t), t * (0.5f + t * (2.0f - 1.5f * t)),
            t * t * (-0.5f + 0.5f * t)};
}

/// Cubic, at a point at least a pixel inside; false elsewhere, and then the value is left as it is.
inline bool sampleInside(const ImageF& picture, double x, double y, float& value)
{
    if (!(x >= 1 && y >= 1 && x < picture.width() - 2 && y < picture.height() - 2)) return false;
    const int x0 = int(x), y0 = int(y);
    const auto wx = cubicWeights(float(x - x0)), wy = cubicWeights(float(y - y0));
    const float* p = picture.row(y0 - 1) + x0 - 1;
    value = 0;
    for (int j = 0; j < 4; ++j, p += picture.width())
        value += wy[std::size_t(j)] * (wx[0] * p[0] + wx[1] * p[1] + wx[2] * p[2] + wx[3] * p[3]);
    return true;
}

struct Gradient {
    float x, y;  // [1/px]
    float square() const { return x * x + y * y; }
};

/// Two pixels inside at least.
inline Gradient gradientAt(const ImageF& picture, int x, int y)
{
    // Fourth order: two of three points would make a slope of a fine texture's too small.
    const float* p = &picture.at(x, y);
    const std::ptrdiff_t w = picture.width();
    return {(8 * (p[1] - p[-1]) - (p[2] - p[-2])) / 12, (8 * (p[w] - p[-w]) - (p[2 * w] - p[-2 * w])) / 12};
}

}  // namespace virga::matte::alignment
