#include "io/Yuv.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "core/Parallel.h"
#include "core/PictureRows.h"
#include "core/Simd.h"

namespace virga::io {

namespace {

/// value = (code - offset) * scale, so that luma and RGB span 0..1 and chroma spans -0.5..0.5.
struct Quantizer {
    float offset, scale, top;  // top: the largest code

    static Quantizer of(int bits, bool fullRange, bool chroma)
    {
        const double top = double((1 << bits) - 1), unit = double(1 << (bits - 8));
        if (chroma) return {float(128 * unit), float(1 / (fullRange ? top : 224 * unit)), float(top)};
        if (fullRange) return {0, float(1 / top), float(top)};
        return {float(16 * unit), float(1 / (219 * unit)), float(top)};
    }
};

/// ITU-T H.273 equations 38-40 solved for R'G'B'.
struct Matrix {
    float kr, kg, kb;
    float redFromCr, blueFromCb, greenFromCb, greenFromCr;

    explicit Matrix(const YuvCoding& coding)
        : kr(float(coding.kr)), kg(float(1 - coding.kr - coding.kb)), kb(float(coding.kb)),
          redFromCr(float(2 * (1 - coding.kr))), blueFromCb(float(2 * (1 - coding.kb))),
          greenFromCb(float(-2 * (1 - coding.kb) * coding.kb / (1 - coding.kr - coding.kb))),
          greenFromCr(float(-2 * (1 - coding.kr) * coding.kr / (1 - coding.kr - coding.kb)))
    {
    }
};

template <class Sample>
VIRGA_INLINE void loadSamples(const Sample* codes, int count, Quantizer q, float* values)
{
    for (int i = 0; i < count; ++i) values[i] = (float(codes[i]) - q.offset) * q.scale;
}

template <class Sample>
VIRGA_INLINE void storeSamples(const float* values, int count, Quantizer q, Sample* codes)
{
    const float inverse = 1.0f / q.scale, offset = q.offset + 0.5f;
    for (int i = 0; i < count; ++i) {
        float code = values[i] * inverse + offset;
        code = code > 0.0f ? code : 0.0f;  // NaN too
        code = code < q.top ? code : q.top;
        codes[i] = Sample(std::int32_t(code));
    }
}

VIRGA_SIMD void loadRow(const void* codes, int bytes, int count, Quantizer q, float* values)
{
    if (bytes == 1)
        loadSamples(static_cast<const std::uint8_t*>(codes), count, q, values);
    else
        loadSamples(static_cast<const std::uint16_t*>(codes), count, q, values);
}

VIRGA_SIMD void storeRow(const float* values, int count, Quantizer q, int bytes, void* codes)
{
    if (bytes == 1)
        storeSamples(values, count, q, static_cast<std::uint8_t*>(codes));
    else
        storeSamples(values, count, q, static_cast<std::uint16_t*>(codes));
}

/// Each chroma sample to the 2^shift columns that share it.
VIRGA_SIMD void repeatChroma(const float* samples, int shift, int width, float* values)
{
    if (shift == 0) {
        for (int x = 0; x < width; ++x) values[x] = samples[x];
    } else if (shift == 1) {
        for (int x = 0; x < width / 2; ++x) {
            values[2 * x] = samples[x];
            values[2 * x + 1] = samples[x];
        }
        if (width % 2 != 0) values[width - 1] = samples[width / 2];
    } else {
        for (int x = 0; x < width; ++x) values[x] = samples[x >> shift];
    }
}

/// A pixel's place among samples: between `sample` and the next one, at the share `next` of the way.
struct Between {
    std::ptrdiff_t sample;
    float next;
};

Between between(std::ptrdiff_t pixel, int shift, double site)
{
    const double place = (double(pixel) - site * ((1 << shift) - 1)) / (1 << shift);
    const double sample = std::floor(place);
    return {std::ptrdiff_t(sample), float(place - sample)};
}

/// Each column from the two chroma samples that are nearest to it; beyond the edges the last one stays. Columns that
/// share a sample are `phase` 0, 1 ... of it.
VIRGA_SIMD void interpolateChroma(const float* samples, int count, int shift, double site, int width, float* values)
{
    const int step = 1 << shift;
    for (int phase = 0; phase < step; ++phase) {
        const Between at = between(phase, shift, site);
        const int left = int(at.sample);  // -1 or 0
        const float next = at.next, here = 1.0f - next;
        for (int c = 0, x = phase; x < width; ++c, x += step)
            values[x] = here * samples[std::max(c + left, 0)] + next * samples[std::min(c + left + 1, count - 1)];
    }
}

/// a += share (b - a).
VIRGA_SIMD void blend(const float* b, float share, int count, float* a)
{
    for (int i = 0; i < count; ++i) a[i] = (1.0f - share) * a[i] + share * b[i];
}

/// sums[c] += the columns of `values` that share chroma sample c.
VIRGA_SIMD void addChroma(const float* values, int shift, int width, float* sums)
{
    if (shift == 0) {
        for (int x = 0; x < width; ++x) sums[x] += values[x];
    } else if (shift == 1) {
        for (int x = 0; x < width / 2; ++x) sums[x] += values[2 * x] + values[2 * x + 1];
        if (width % 2 != 0) sums[width / 2] += values[width - 1];
    } else {
        for (int x = 0; x < width; ++x) sums[x >> shift] += values[x];
    }
}

/// red: in luma, out R'. blue: in Cb, out B'. green: in Cr, out G'.
VIRGA_SIMD void rgbFromYuv(Matrix m, int count, float* red, float* green, float* blue)
{
    for (int i = 0; i < count; ++i) {
        const float luma = red[i], cb = blue[i], cr = green[i];
        red[i] = luma + m.redFromCr * cr;
        green[i] = luma + m.greenFromCb * cb + m.greenFromCr * cr;
        blue[i] = luma + m.blueFromCb * cb;
    }
}

/// The inverse, into the same places.
VIRGA_SIMD void yuvFromRgb(Matrix m, int count, float* red, float* green, float* blue)
{
    const float cbScale = 1.0f / m.blueFromCb, crScale = 1.0f / m.redFromCr;
    for (int i = 0; i < count; ++i) {
        const float luma = m.kr * red[i] + m.kg * green[i] + m.kb * blue[i];
        const float cb = (blue[i] - luma) * cbScale, cr = (red[i] - luma) * crScale;
        red[i] = luma;
        blue[i] = cb;
        green[i] = cr;
    }
}

/// ITU-T H.273 equations 50-52, Cg where Cb is and Co where Cr is.
VIRGA_SIMD void rgbFromYCgCo(int count, float* red, float* green, float* blue)
{
    for (int i = 0; i < count; ++i) {
        const float luma = red[i], cg = blue[i], co = green[i];
        red[i] = luma - cg + co;
        green[i] = luma + cg;
        blue[i] = luma - cg - co;
    }
}

/// Equations 47-49, into the same places.
VIRGA_SIMD void yCgCoFromRgb(int count, float* red, float* green, float* blue)
{
    for (int i = 0; i < count; ++i) {
        const float sum = 0.25f * (red[i] + blue[i]), co = 0.5f * (red[i] - blue[i]), half = 0.5f * green[i];
        red[i] = half + sum;
        blue[i] = half - sum;
        green[i] = co;
    }
}

VIRGA_SIMD void interleave(const float* red, const float* green, const float* blue, const float* alpha, int count,
                           float* rgba)
{
    if (alpha == nullptr) {
        for (int i = 0; i < count; ++i) {
            rgba[4 * i] = red[i];
            rgba[4 * i + 1] = green[i];
            rgba[4 * i + 2] = blue[i];
            rgba[4 * i + 3] = 1.0f;
        }
    } else {
        for (int i = 0; i < count; ++i) {
            rgba[4 * i] = red[i] * alpha[i];
            rgba[4 * i + 1] = green[i] * alpha[i];
            rgba[4 * i + 2] = blue[i] * alpha[i];
            rgba[4 * i + 3] = alpha[i];
        }
    }
}

VIRGA_SIMD void deinterleave(const float* rgba, int count, float* red, float* green, float* blue, float* alpha)
{
    if (alpha == nullptr) {
        for (int i = 0; i < count; ++i) {
            red[i] = rgba[4 * i];
            green[i] = rgba[4 * i + 1];
            blue[i] = rgba[4 * i + 2];
        }
    } else {
        for (int i = 0; i < count; ++i) {
            const float a = rgba[4 * i + 3];
            const float inverse = a > 0.0f ? 1.0f / a : 0.0f;
            red[i] = rgba[4 * i] * inverse;
            green[i] = rgba[4 * i + 1] * inverse;
            blue[i] = rgba[4 * i + 2] * inverse;
            alpha[i] = a;
        }
    }
}

int samplesFor(int length, int shift) { return (length + (1 << shift) - 1) >> shift; }

/// A few rows of floats that stay in the cache while a row of pixels goes through its steps.
class Rows {
public:
    Rows(int width, int count) : width_(std::size_t(width)), values_(width_ * std::size_t(count)) {}
    float* operator[](int i) { return values_.data() + std::size_t(i) * width_; }

private:
    std::size_t width_;
    std::vector<float> values_;
};

constexpr int rowsPerPiece = 16;  // a multiple of every chroma height, and enough work to hand to a thread

}  // namespace

void planarToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                    const ColorTransform& toLinear, ImageView<float> rgba, const ChromaFilter& filter)
{
    parallelFor(0, picture.height, rowsPerPiece, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        planarRowsToLinear(format, coding, picture, toLinear, int(first), rowsOf(rgba, int(first), int(last)), filter);
    });
}

void planarRowsToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                        const ColorTransform& toLinear, int firstRow, ImageView<float> rgba, const ChromaFilter& filter)
{
    const int width = picture.width, bytes = format.bytesPerSample();
    const Quantizer lumaQ = Quantizer::of(format.bits, coding.fullRange, false);
    const Quantizer chromaQ = Quantizer::of(format.bits, coding.fullRange, true);
    const Quantizer alphaQ = Quantizer::of(format.bits, true, false);
    const Matrix matrix(coding);
    const bool isYuv = format.family == PlanarFormat::Family::Yuv, isGrey = format.family == PlanarFormat::Family::Grey;
    const int chromaWidth = samplesFor(width, format.chromaShiftX);
    const int chromaHeight = samplesFor(picture.height, format.chromaShiftY);
    const bool smoothX = filter.x.isInterpolated && format.chromaShiftX > 0;
    const bool smoothY = filter.y.isInterpolated && format.chromaShiftY > 0;
    const bool transform = !toLinear.isIdentity();

    Rows rows(width, 6);
    float *red = rows[0], *green = rows[1], *blue = rows[2], *alpha = rows[3], *chroma = rows[4], *below = rows[5];
    for (int k = 0; k < rgba.height(); ++k) {
        const std::ptrdiff_t y = firstRow + k;
        const auto row = [&](int plane, std::ptrdiff_t line) {
            return picture.planes[std::size_t(plane)] + line * picture.strides[std::size_t(plane)];
        };
        const auto loadChroma = [&](int plane, float* values) {
            if (smoothY) {
                const Between at = between(y, format.chromaShiftY, filter.y.site);
                const auto held = [&](std::ptrdiff_t r) { return std::clamp<std::ptrdiff_t>(r, 0, chromaHeight - 1); };
                loadRow(row(plane, held(at.sample)), bytes, chromaWidth, chromaQ, chroma);
                loadRow(row(plane, held(at.sample + 1)), bytes, chromaWidth, chromaQ, below);
                blend(below, at.next, chromaWidth, chroma);
            } else {
                loadRow(row(plane, y >> format.chromaShiftY), bytes, chromaWidth, chromaQ, chroma);
            }
            if (smoothX)
                interpolateChroma(chroma, chromaWidth, format.chromaShiftX, filter.x.site, width, values);
            else
                repeatChroma(chroma, format.chromaShiftX, width, values);
        };
        if (isYuv) {
            loadRow(row(0, y), bytes, width, lumaQ, red);
            loadChroma(1, blue);
            loadChroma(2, green);
            if (coding.isYCgCo)
                rgbFromYCgCo(width, red, green, blue);
            else
                rgbFromYuv(matrix, width, red, green, blue);
        } else if (isGrey) {
            loadRow(row(0, y), bytes, width, lumaQ, red);
            std::copy_n(red, width, green);
            std::copy_n(red, width, blue);
        } else {
            loadRow(row(0, y), bytes, width, lumaQ, green);
            loadRow(row(1, y), bytes, width, lumaQ, blue);
            loadRow(row(2, y), bytes, width, lumaQ, red);
        }
        if (transform) toLinear.apply(red, green, blue, std::size_t(width));
        if (format.hasAlpha) loadRow(row(format.planes() - 1, y), bytes, width, alphaQ, alpha);
        interleave(red, green, blue, format.hasAlpha ? alpha : nullptr, width, rgba.row(k));
    }
}

void linearToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                    const ColorTransform& toCode, const PlanarPicture& picture)
{
    // Whole chroma rows to a thread.
    const int blockRows = 1 << format.chromaShiftY;
    parallelFor(0, samplesFor(picture.height, format.chromaShiftY), rowsPerPiece / blockRows,
                [&](std::ptrdiff_t firstBlock, std::ptrdiff_t lastBlock) {
                    const int first = int(firstBlock) * blockRows;
                    const int last = std::min(int(lastBlock) * blockRows, picture.height);
                    linearRowsToPlanar(format, coding, rowsOf(rgba, first, last), toCode, first, picture);
                });
}

void linearRowsToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                        const ColorTransform& toCode, int firstRow, const PlanarPicture& picture)
{
    const int width = picture.width, bytes = format.bytesPerSample(), lastRow = firstRow + rgba.height();
    const Quantizer lumaQ = Quantizer::of(format.bits, coding.fullRange, false);
    const Quantizer chromaQ = Quantizer::of(format.bits, coding.fullRange, true);
    const Quantizer alphaQ = Quantizer::of(format.bits, true, false);
    const Matrix matrix(coding);
    const bool isYuv = format.family == PlanarFormat::Family::Yuv, isGrey = format.family == PlanarFormat::Family::Grey;
    const int chromaWidth = samplesFor(width, format.chromaShiftX);
    const int blockRows = 1 << format.chromaShiftY, blockColumns = 1 << format.chromaShiftX;
    const bool transform = !toCode.isIdentity();
    assert(firstRow % blockRows == 0 && (lastRow % blockRows == 0 || lastRow == picture.height));

    Rows rows(width, 6);
    float *red = rows[0], *green = rows[1], *blue = rows[2], *alpha = format.hasAlpha ? rows[3] : nullptr;
    float *cbSums = rows[4], *crSums = rows[5];
    const auto row = [&](int plane, std::ptrdiff_t line) {
        return picture.planes[std::size_t(plane)] + line * picture.strides[std::size_t(plane)];
    };
    for (int top = firstRow; top < lastRow; top += blockRows) {
        const int bottom = std::min(top + blockRows, lastRow);
        std::fill_n(cbSums, chromaWidth, 0.0f);
        std::fill_n(crSums, chromaWidth, 0.0f);
        for (int y = top; y < bottom; ++y) {
            deinterleave(rgba.row(y - firstRow), width, red, green, blue, alpha);
            if (transform) toCode.apply(red, green, blue, std::size_t(width));
            if (alpha != nullptr) storeRow(alpha, width, alphaQ, bytes, row(format.planes() - 1, y));
            if (format.family == PlanarFormat::Family::Rgb) {
                storeRow(green, width, lumaQ, bytes, row(0, y));
                storeRow(blue, width, lumaQ, bytes, row(1, y));
                storeRow(red, width, lumaQ, bytes, row(2, y));
                continue;
            }
            if (coding.isYCgCo)
                yCgCoFromRgb(width, red, green, blue);
            else
                yuvFromRgb(matrix, width, red, green, blue);
            storeRow(red, width, lumaQ, bytes, row(0, y));
            if (isGrey) continue;
            addChroma(blue, format.chromaShiftX, width, cbSums);
            addChroma(green, format.chromaShiftX, width, crSums);
        }
        if (!isYuv) continue;
        for (int c = 0; c < chromaWidth; ++c) {
            const int columns = std::min(blockColumns, width - (c << format.chromaShiftX));
            const float share = 1.0f / float(columns * (bottom - top));
            cbSums[c] *= share;
            crSums[c] *= share;
        }
        storeRow(cbSums, chromaWidth, chromaQ, bytes, row(1, top / blockRows));
        storeRow(crSums, chromaWidth, chromaQ, bytes, row(2, top / blockRows));
    }
}

}  // namespace virga::io
