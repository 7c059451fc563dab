// Transfer curves: code values 0..1 of a picture <-> linear light. All are extended beyond 0..1 so that they stay
// invertible, because YCbCr holds colours outside the RGB cube, light filters ring below black, and both have to come
// back. Above 1 the same formula goes on (PQ: its tangent at 1). Below 0 display curves are mirrored about the origin;
// logarithms go on along their own straight toe, and those that have none (Cineon under code 0, ACEScc under the code
// of black) along their tangent there.
#pragma once

#include <cstddef>
#include <optional>

#include "core/PlanarPicture.h"

namespace virga::io {

enum class Curve {
    Linear,
    Srgb,          ///< IEC 61966-2-1. Also what display-referred video is linearised with, see ColorSpaces.h
    Rec709Camera,  ///< inverse of the camera curve of ITU-R BT.709 (and 601, 2020)
    Bt1886,        ///< ITU-R BT.1886 with a black of 0: a power of 2.4
    Gamma22,
    Gamma26,  ///< SMPTE RP 431-2, digital cinema; linear 1 is code 1
    Gamma28,
    AdobeRgb,  ///< Adobe RGB (1998): a power of 563/256
    Pq,        ///< SMPTE ST 2084; linear 1 = 100 cd/m2
    Hlg,       ///< ITU-R BT.2100, inverse of the camera curve; linear 1 = code 1
    // Logarithms. Code 1 is all bits set, linear 0.18 a grey card; none is mirrored unless its maker does it.
    Cineon,     ///< Kodak printing density, 10 bit: black 95, white 685, 0.002 a code, density 0.6 a decade
    AcesCc,     ///< AMPAS S-2014-003
    AcesCct,    ///< AMPAS S-2016-001
    ArriLogC3,  ///< ARRI ALEXA LogC, exposure index 800
    ArriLogC4,  ///< ARRI LogC4 specification, 2022
    SLog3,      ///< Sony S-Log3, 2014
    CanonLog2,
    CanonLog3,            ///< Canon, 2018, mirrored by Canon about its code of black
    VLog,                 ///< Panasonic V-Log, 2014
    Log3G10,              ///< RED, 2017
    BmdFilmGen5,          ///< Blackmagic Film, generation 5, 2021
    DavinciIntermediate,  ///< Blackmagic, 2021
};

/// Code values -> linear light, in place. Powers are in float: within 2e-7 of the formula for codes to 1, within 6.1e-7
/// of the value for codes to 4. The rest is the formula in double, rounded once. NaN stays NaN.
void decodeCurve(Curve curve, float* values, std::size_t count) noexcept;

/// Linear light -> code values, in place. Powers within 1.3e-7 of the formula for codes to 1, within 2.6e-7 of the
/// value for codes to 4; the rest rounded once. NaN stays NaN.
void encodeCurve(Curve curve, float* values, std::size_t count) noexcept;

/// The curve, if it is a power (or none at all).
std::optional<PowerCurve> powerOf(Curve curve) noexcept;

/// The formulas themselves, in double precision: what the two above are tested against.
double decodeCurveExact(Curve curve, double code) noexcept;
double encodeCurveExact(Curve curve, double linear) noexcept;

}  // namespace virga::io
