// Colours under alpha through a curve.

#include "core/Parallel.h"
#include "io/ImageFile.h"

namespace virga::io {

namespace {

constexpr std::ptrdiff_t rowsPerPiece = 16;

/// Takes rows apart into red, green and blue, with or without alpha in them, and puts them together again.
template <bool divideBefore, bool multiplyAfter>
void transformRows(ImageView<float> pixels, const ColorTransform& transform)
{
    const bool hasAlpha = pixels.channels() == 4;
    // Where alpha is 0, straight colours are lost, and multiplied ones stay what they are.
    const float atZero = divideBefore && multiplyAfter ? 1.0f : 0.0f;
    parallelFor(0, pixels.height(), rowsPerPiece, [&](std::ptrdiff_t top, std::ptrdiff_t bottom) {
        const std::size_t width = std::size_t(pixels.width());
        std::vector<float> rows(3 * width);
        float *red = rows.data(), *green = red + width, *blue = green + width;
        for (std::ptrdiff_t y = top; y < bottom; ++y) {
            float* row = pixels.row(int(y));
            const std::size_t step = std::size_t(pixels.channels());
            for (std::size_t x = 0; x < width; ++x) {
                const float* p = row + step * x;
                float scale = 1.0f;
                if (divideBefore && hasAlpha) scale = p[3] > 0.0f ? 1.0f / p[3] : atZero;
                red[x] = p[0] * scale;
                green[x] = p[1] * scale;
                blue[x] = p[2] * scale;
            }
            transform.apply(red, green, blue, width);
            for (std::size_t x = 0; x < width; ++x) {
                float* p = row + step * x;
                float scale = 1.0f;
                if (multiplyAfter && hasAlpha) scale = p[3] > 0.0f ? p[3] : atZero;
                p[0] = red[x] * scale;
                p[1] = green[x] * scale;
                p[2] = blue[x] * scale;
            }
        }
    });
}

}  // namespace

void codesToLinear(ImageF& rgba, const ColorTransform& toLinear, bool isStraight, bool hasAlpha)
{
    if (!hasAlpha && toLinear.isIdentity()) return;
    if (!hasAlpha)
        transformRows<false, false>(rgba, toLinear);
    else if (isStraight)
        transformRows<false, true>(rgba, toLinear);
    else if (!toLinear.isIdentity())
        transformRows<true, true>(rgba, toLinear);
}

void linearToCodes(ImageView<float> pixels, const ColorTransform& toCodes, bool isStraight)
{
    const bool hasAlpha = pixels.channels() == 4;
    if (toCodes.isIdentity() && !(hasAlpha && isStraight)) return;
    if (isStraight)
        transformRows<true, false>(pixels, toCodes);
    else
        transformRows<true, true>(pixels, toCodes);
}

}  // namespace virga::io
