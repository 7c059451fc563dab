// Planar video pictures <-> scene-linear RGBA, in one pass over the rows.
//
// Laws (tests/io/yuv_test.cpp): codes -> RGBA -> codes gives the same codes for every format, 8 to 16 bit, also for
// YCbCr outside the RGB cube. For that, chroma is repeated on the way in and averaged over the samples that share it on
// the way out, both of the codes (not of light), and nothing is clipped until a code is stored. Where the result does
// not share chroma as the picture does, repeating would leave blocks, shifted by up to half of one: then chroma is
// interpolated between the places where it was taken (ChromaFilter), linearly and in the codes, as zimg's "bilinear".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/Image.h"
#include "io/ColorTransform.h"

namespace virga::io {

/// How samples lie in memory. Samples are bytes up to 8 bits, else 16-bit words of this machine with the value in the
/// low bits. Planes: Y Cb Cr [A], G B R [A] (FFmpeg's order), or grey [A].
struct PlanarFormat {
    enum class Family { Yuv, Rgb, Grey };
    Family family = Family::Yuv;
    int bits = 8;           ///< of a sample, 8..16
    int chromaShiftX = 0;   ///< log2 of the luma columns that share a chroma sample (Yuv), 0..2
    int chromaShiftY = 0;   ///< the same for rows
    bool hasAlpha = false;  ///< full range always, as the decoders give it

    int bytesPerSample() const { return bits > 8 ? 2 : 1; }
    int planes() const { return (family == Family::Grey ? 1 : 3) + (hasAlpha ? 1 : 0); }
    bool operator==(const PlanarFormat&) const = default;
};

/// What the codes mean. ITU-T H.273.
struct YuvCoding {
    double kr = 0.2126,
           kb = 0.0722;      ///< weight of red and blue in luma: BT.709 (601: 0.299, 0.114; 2020: 0.2627, 0.0593)
    bool fullRange = false;  ///< 0..2^bits-1, else 16..235 and 16..240 scaled to the bits
    bool isYCgCo = false;    ///< planes are Y Cg Co (equations 47-52) and have no weights: kr and kb are not used

    bool operator==(const YuvCoding&) const = default;
};

/// How chroma that pixels share comes to each of them, along one axis.
struct ChromaAxis {
    bool isInterpolated = false;  ///< else repeated
    double site =
        0;  ///< place of a sample in the pixels that share it: 0 the first of them, 0.5 the middle, 1 the last
};
struct ChromaFilter {
    ChromaAxis x, y;
};

template <class Byte>
struct BasicPlanarPicture {
    int width = 0, height = 0;
    std::array<Byte*, 4> planes{};
    std::array<std::ptrdiff_t, 4> strides{};  // [bytes]
};
using PlanarPicture = BasicPlanarPicture<std::uint8_t>;
using ConstPlanarPicture = BasicPlanarPicture<const std::uint8_t>;

/// R'G'B' codes scaled to 0..1 go through `toLinear`, then are multiplied by alpha (1 where there is none).
/// rgba  picture.width x picture.height x 4
void planarToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                    const ColorTransform& toLinear, ImageView<float> rgba, const ChromaFilter& chroma = {});

/// The rows from `firstRow` on alone, on this thread; rgba has the picture's width.
void planarRowsToLinear(const PlanarFormat& format, const YuvCoding& coding, const ConstPlanarPicture& picture,
                        const ColorTransform& toLinear, int firstRow, ImageView<float> rgba,
                        const ChromaFilter& chroma = {});

/// The other way: divided by alpha if the format has one (alpha 0 gives black), through `toCode`, rounded to nearest
/// and held to what a sample can hold; NaN gives 0. Luma and chroma may pass 235 and 16: footage does.
void linearToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                    const ColorTransform& toCode, const PlanarPicture& picture);

/// The rows from `firstRow` on alone, on this thread: whole blocks of rows that share their chroma, or to the picture's
/// end.
void linearRowsToPlanar(const PlanarFormat& format, const YuvCoding& coding, ConstImageViewF rgba,
                        const ColorTransform& toCode, int firstRow, const PlanarPicture& picture);

}  // namespace virga::io
