// Depth in several channels of 8 bits, so that files and movies made for pictures carry it.
#pragma once

#include <array>

namespace virga::depth {

enum class DepthPacking {
    None,
    Rg,   ///< 16 bits: 256 red + green
    Gr,   ///< 16 bits: 256 green + red
    Rgb,  ///< 24 bits: 65536 red + 256 green + blue
    Bgr,  ///< 24 bits: 65536 blue + 256 green + red (CARLA's depth camera)
    /// 0 to 1529 once around the hues from red over green and blue, which lossy codecs keep well: Sonoda &
    /// Grunnet-Jepsen, "Depth image compression by colorization for Intel RealSense depth cameras". Dark pixels have
    /// no depth; 1529 itself is all red and reads as 0.
    Hue,
};

/// The largest value.
double largestPacked(DepthPacking packing) noexcept;

/// Whether codecs may change the codes a little without ruining the depth.
constexpr bool survivesLoss(DepthPacking packing) noexcept { return packing == DepthPacking::Hue; }

/// The value of a pixel by its codes of 0 to 255; NaN where there is none. Not for None.
double unpackedDepth(DepthPacking packing, const std::array<double, 3>& rgb) noexcept;

}  // namespace virga::depth
