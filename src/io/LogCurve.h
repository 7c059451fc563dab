// The logarithmic ones among the curves of Curve.h, where their makers' documents are named. Double precision.
#pragma once

#include "io/Curve.h"

namespace virga::io {

constexpr bool isLogarithm(Curve curve) noexcept { return curve >= Curve::Cineon; }

/// For curves that are logarithms. Neither throws; NaN stays NaN.
double decodeLogarithm(Curve curve, double code) noexcept;
double encodeLogarithm(Curve curve, double linear) noexcept;

}  // namespace virga::io
