#include "depth/DepthPacking.h"

#include <limits>

namespace virga::depth {
namespace {

/// Six slopes of 255 steps around the hues; the brightest channel tells which two, the others' difference where on
/// them. After a codec the third channel need not be 0 any more, and cancels.
double hueValue(double red, double green, double blue) noexcept
{
    constexpr double dark = 255;  // the sum of all three, of a colour at full brightness at least
    if (red + green + blue < dark) return std::numeric_limits<double>::quiet_NaN();
    if (green >= blue) return red >= green ? green - blue : blue - red + 510;
    return red > blue ? green - blue + 1529 : red - green + 1020;
}

}  // namespace

double largestPacked(DepthPacking packing) noexcept
{
    switch (packing) {
        case DepthPacking::Rg:
        case DepthPacking::Gr: return 65535;
        case DepthPacking::Rgb:
        case DepthPacking::Bgr: return 16777215;
        case DepthPacking::Hue: return 1529;
        case DepthPacking::None: break;
    }
    return 1;
}

double unpackedDepth(DepthPacking packing, const std::array<double, 3>& rgb) noexcept
{
    const auto [red, green, blue] = rgb;
    switch (packing) {
        case DepthPacking::Rg: return 256 * red + green;
        case DepthPacking::Gr: return 256 * green + red;
        case DepthPacking::Rgb: return 65536 * red + 256 * green + blue;
        case DepthPacking::Bgr: return 65536 * blue + 256 * green + red;
        case DepthPacking::Hue: return hueValue(red, green, blue);
        case DepthPacking::None: break;
    }
    return red;
}

}  // namespace virga::depth
