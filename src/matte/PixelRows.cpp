#include "matte/PixelRows.h"

#include <algorithm>
#include <cassert>

#include "core/Simd.h"

namespace virga::matte {
namespace {

template <int channels>
VIRGA_INLINE void differAny(const float* __restrict values, const float* __restrict from, std::size_t width,
                            float* __restrict to)
{
    for (std::size_t i = 0; i < width; ++i) {
        float sum = 0.0f;
        for (std::size_t j = 0; j < channels; ++j) sum += values[i * channels + j] - from[i * channels + j];
        to[i] = sum / float(channels);
    }
}
VIRGA_SIMD void differ(const float* values, const float* from, int channels, std::size_t width, float* to)
{
    if (channels == 3)
        differAny<3>(values, from, width, to);
    else
        differAny<1>(values, from, width, to);
}

VIRGA_SIMD void repeatThrice(const float* __restrict row, int width, float* __restrict to)
{
    int x = 0;
    for (; x + 8 <= width; x += 8) {
        const PackOf<float>::Type eight = PackOf<float>::at(row + x);
        PackOf<float>::at(to + 3 * x) = __builtin_shufflevector(eight, eight, 0, 0, 0, 1, 1, 1, 2, 2);
        PackOf<float>::at(to + 3 * x + 8) = __builtin_shufflevector(eight, eight, 2, 3, 3, 3, 4, 4, 4, 5);
        PackOf<float>::at(to + 3 * x + 16) = __builtin_shufflevector(eight, eight, 5, 5, 6, 6, 6, 7, 7, 7);
    }
    for (; x < width; ++x) to[3 * x] = to[3 * x + 1] = to[3 * x + 2] = row[x];
}

}  // namespace

void repeatRow(const float* row, int width, int channels, float* to)
{
    assert(channels == 1 || channels == 3);
    if (channels == 3)
        repeatThrice(row, width, to);
    else
        std::copy_n(row, width, to);
}

void meanDifference(const float* values, const float* from, int channels, std::size_t width, float* to)
{
    assert(channels == 1 || channels == 3);
    differ(values, from, channels, width, to);
}

}  // namespace virga::matte
