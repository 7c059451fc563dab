// The greyish look of a rainy day: each pixel is blended with its luminance, then scaled. Starik & Werman 2003
// ("Simulation of rain in videos") average the two, which is desaturate = 1/2; Wang et al. 2006, section 5, let the
// user set the amount.
//   out = (1 - darken) ((1 - desaturate) c + desaturate Y),   Y = weights . c
// in scene-linear light. It is linear in c, so premultiplied pixels stay premultiplied and values over 1 stay in place.
#pragma once

#include <array>

namespace virga::grade {

/// Luminance of Rec.709 primaries; other primaries have their own weights, which add up to 1.
inline constexpr std::array<double, 3> kRec709Luminance{0.2126, 0.7152, 0.0722};

struct Darkening {
    double desaturate = 0;  // 0 keeps the colour, 1 is grey; 0..1
    double darken = 0;      // 0 keeps the brightness, 1 is black; 0..1

    /// True if no pixel changes: the pass is left out.
    bool isIdentity() const noexcept { return desaturate == 0 && darken == 0; }
};

/// One pixel. The reference for the GPU's grade pass. Returns c itself, bit for bit, where nothing is to be changed
/// (an infinite channel would else spoil the others). Does not throw.
std::array<double, 3> darkened(const std::array<double, 3>& c, const Darkening& darkening,
                               const std::array<double, 3>& weights = kRec709Luminance) noexcept;

}  // namespace virga::grade
