// Transfer curves: code values 0..1 of a picture <-> linear light. All are extended beyond 0..1 so that they stay
// invertible: below 0 mirrored about the origin, above 1 by the same formula (PQ by its tangent at 1), because YCbCr
// holds colours outside the RGB cube and they have to come back.
#pragma once

#include <cstddef>

namespace virga::io {

enum class Curve {
    Linear,
    Srgb,          ///< IEC 61966-2-1. Also what display-referred video is linearised with, see ColorConversion.h
    Rec709Camera,  ///< inverse of the camera curve of ITU-R BT.709 (and 601, 2020)
    Bt1886,        ///< ITU-R BT.1886 with a black of 0: a power of 2.4
    Gamma22,
    Gamma26,  ///< SMPTE RP 431-2, digital cinema
    Gamma28,
    Pq,      ///< SMPTE ST 2084; linear 1 = 100 cd/m2
    Cineon,  ///< Kodak printing density, 10 bit: black 95, white 685, 0.002 a code, density 0.6 a decade; not mirrored
    Hlg,     ///< ITU-R BT.2100, inverse of the camera curve; linear 1 = code 1
};

/// Code values -> linear light, in place. Within 1e-6 of the formula for codes 0..1; NaN stays NaN.
void decodeCurve(Curve curve, float* values, std::size_t count) noexcept;

/// Linear light -> code values, in place. Inverse of decodeCurve to 1e-6 of the value or better.
void encodeCurve(Curve curve, float* values, std::size_t count) noexcept;

/// The formulas themselves, in double precision: what the two above are tested against.
double decodeCurveExact(Curve curve, double code) noexcept;
double encodeCurveExact(Curve curve, double linear) noexcept;

}  // namespace virga::io
