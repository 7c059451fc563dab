#include "matte/ColumnPlane.h"

#include "core/Simd.h"

namespace virga::matte {
namespace {

template <class Real>
VIRGA_INLINE void splitAny(const Real* __restrict row, int width, Real* __restrict even, Real* __restrict odd)
{
    for (int j = 0; j < width / 2; ++j) {
        even[j] = row[2 * j];
        odd[j] = row[2 * j + 1];
    }
    if (width % 2) even[width / 2] = row[width - 1];
}
template <class Real>
VIRGA_INLINE void mergeAny(const Real* __restrict even, const Real* __restrict odd, int width, float* __restrict row)
{
    for (int j = 0; j < width / 2; ++j) {
        row[2 * j] = float(even[j]);
        row[2 * j + 1] = float(odd[j]);
    }
    if (width % 2) row[width - 1] = float(even[width / 2]);
}
/// Eight rows of eight become columns.
VIRGA_INLINE void turnTile(const float* from, std::ptrdiff_t fromStep, float* to, std::ptrdiff_t toStep)
{
    using P = PackOf<float>;
    P::Type a[8], b[8];
    for (int k = 0; k < 8; k += 2) {
        const P::Type even = P::at(from + k * fromStep), odd = P::at(from + (k + 1) * fromStep);
        a[k] = __builtin_shufflevector(even, odd, 0, 8, 1, 9, 4, 12, 5, 13);
        a[k + 1] = __builtin_shufflevector(even, odd, 2, 10, 3, 11, 6, 14, 7, 15);
    }
    for (int k = 0; k < 8; k += 4)
        for (int h = 0; h < 2; ++h) {
            b[k + 2 * h] = __builtin_shufflevector(a[k + h], a[k + h + 2], 0, 1, 8, 9, 4, 5, 12, 13);
            b[k + 2 * h + 1] = __builtin_shufflevector(a[k + h], a[k + h + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
    for (int k = 0; k < 4; ++k) {
        P::at(to + k * toStep) = __builtin_shufflevector(b[k], b[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        P::at(to + (k + 4) * toStep) = __builtin_shufflevector(b[k], b[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
    }
}

}  // namespace

VIRGA_SIMD void split(const float* row, int width, float* even, float* odd) { splitAny(row, width, even, odd); }
VIRGA_SIMD void split(const double* row, int width, double* even, double* odd) { splitAny(row, width, even, odd); }

VIRGA_SIMD void merge(const float* even, const float* odd, int width, float* row) { mergeAny(even, odd, width, row); }
VIRGA_SIMD void merge(const double* even, const double* odd, int width, float* row) { mergeAny(even, odd, width, row); }

VIRGA_SIMD void turnTiles(const float* from, std::ptrdiff_t fromStep, std::ptrdiff_t fromNext, float* to,
                          std::ptrdiff_t toStep, std::ptrdiff_t toNext, int tiles)
{
    for (int n = 0; n < tiles; ++n) turnTile(from + n * fromNext, fromStep, to + n * toNext, toStep);
}

}  // namespace virga::matte
