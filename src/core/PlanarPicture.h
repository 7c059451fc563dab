// Pictures of codes: how they lie in memory, and what they mean.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace virga {

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

/// A curve of one power between codes c, 0..1, and light: c / slope up to `toe`, ((c + offset) / (1 + offset))^power
/// above it, mirrored about 0. The default is no curve at all.
struct PowerCurve {
    double power = 1, offset = 0, slope = 1, toe = -1;
};

/// Codes with all that it takes to make light of them, or them of light.
template <class Byte>
struct BasicCodedPlanes {
    PlanarFormat format;
    YuvCoding coding;
    ChromaFilter chroma;  ///< of codes that become light
    PowerCurve curve;
    BasicPlanarPicture<Byte> picture;
};
using CodedPlanes = BasicCodedPlanes<std::uint8_t>;
using ConstCodedPlanes = BasicCodedPlanes<const std::uint8_t>;

}  // namespace virga
