#include "io/Curve.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/Simd.h"
#include "io/LogCurve.h"

namespace virga::io {

namespace {

// IEC 61966-2-1: 0.04045 and 12.92 as printed. The pieces miss each other by 1e-8, which is below float.
constexpr PowerCurve srgb{2.4, 0.055, 12.92, 0.04045};
// ITU-R BT.2020 table 4 gives BT.709's alpha and beta with the digits that make the pieces meet.
constexpr double bt709Alpha = 1.09929682680944, bt709Beta = 0.018053968510807;
constexpr PowerCurve rec709Camera{1 / 0.45, bt709Alpha - 1, 4.5, 4.5 * bt709Beta};

constexpr PowerCurve powerCurve(Curve curve)
{
    switch (curve) {
        case Curve::Srgb: return srgb;
        case Curve::Rec709Camera: return rec709Camera;
        case Curve::Bt1886: return {2.4, 0, 1, 0};
        case Curve::Gamma22: return {2.2, 0, 1, 0};
        case Curve::Gamma26: return {2.6, 0, 1, 0};
        case Curve::AdobeRgb: return {563.0 / 256, 0, 1, 0};
        default: return {2.8, 0, 1, 0};
    }
}

constexpr bool isPower(Curve curve) { return curve < Curve::Pq; }

/// x^p for x > 0 to about 2 ulp of its exponent's precision. Polynomials of Moshier's Cephes library (logf, exp2f).
VIRGA_INLINE float fastPower(float x, float p)
{
    // x = m * 2^e with m in [sqrt 1/2, sqrt 2)
    const std::int32_t bits = std::bit_cast<std::int32_t>(x);
    const std::int32_t e = (bits - 0x3f3504f3) >> 23;
    const float f = std::bit_cast<float>(bits - (e << 23)) - 1.0f;
    float log = 7.0376836292e-2f;
    log = log * f - 1.1514610310e-1f;
    log = log * f + 1.1676998740e-1f;
    log = log * f - 1.2420140846e-1f;
    log = log * f + 1.4249322787e-1f;
    log = log * f - 1.6668057665e-1f;
    log = log * f + 2.0000714765e-1f;
    log = log * f - 2.4999993993e-1f;
    log = log * f + 3.3333331174e-1f;
    log = log * (f * f * f) - 0.5f * (f * f) + f;

    const float exponent = p * float(e) + (p * 1.44269504088896341f) * log;
    constexpr float roundToInteger = 12582912.0f;  // 1.5 * 2^23: adding it leaves no bits for a fraction
    float whole = (exponent + roundToInteger) - roundToInteger;
    const float r = exponent - whole;
    whole = whole < -126.0f ? -126.0f : whole;
    whole = whole > 127.0f ? 127.0f : whole;
    float exp2 = 1.535336188319500e-4f;
    exp2 = exp2 * r + 1.339887440266574e-3f;
    exp2 = exp2 * r + 9.618437357674640e-3f;
    exp2 = exp2 * r + 5.550332471162809e-2f;
    exp2 = exp2 * r + 2.402264791363012e-1f;
    exp2 = exp2 * r + 6.931472028550421e-1f;
    exp2 = exp2 * r + 1.0f;
    return exp2 * std::bit_cast<float>((std::int32_t(whole) + 127) << 23);
}

VIRGA_SIMD void decodePower(float* values, std::size_t count, float power, float offset, float slope, float toe)
{
    const float scale = 1.0f / (1.0f + offset), inverseSlope = 1.0f / slope;
    for (std::size_t i = 0; i < count; ++i) {
        const float value = values[i], size = std::fabs(value);
        const float curved = fastPower((size + offset) * scale, power), straight = size * inverseSlope;
        const float linear = size <= toe ? straight : curved;
        // Infinity and NaN are no code values of any file, but they must not turn into some.
        const float kept = size <= std::numeric_limits<float>::max() ? linear : size;
        values[i] = std::copysign(kept, value);
    }
}

VIRGA_SIMD void encodePower(float* values, std::size_t count, float power, float offset, float slope, float toe)
{
    const float inversePower = 1.0f / power, linearToe = toe / slope;
    for (std::size_t i = 0; i < count; ++i) {
        const float value = values[i], size = std::fabs(value);
        const float curved = fastPower(size, inversePower) * (1.0f + offset) - offset, straight = size * slope;
        const float code = size <= linearToe ? straight : curved;
        const float kept = size <= std::numeric_limits<float>::max() ? code : size;
        values[i] = std::copysign(kept, value);
    }
}

// SMPTE ST 2084:2014, equations 4.1 and 5.2.
constexpr double pqM1 = 2610.0 / 16384, pqM2 = 2523.0 / 4096 * 128;
constexpr double pqC1 = 3424.0 / 4096, pqC2 = 2413.0 / 4096 * 32, pqC3 = 2392.0 / 4096 * 32;
constexpr double pqPeak = 100;  // 10000 cd/m2 where 100 cd/m2 is 1

double pqDecode(double code)
{
    // d(linear)/d(code) at code 1 of the formula, for the tangent above it.
    const double slopeAtOne = pqPeak / (pqM1 * pqM2) * (1 / (1 - pqC1) + pqC3 / (pqC2 - pqC3));
    if (code > 1) return pqPeak + slopeAtOne * (code - 1);
    const double root = std::pow(code, 1 / pqM2);
    return pqPeak * std::pow(std::fmax(root - pqC1, 0) / (pqC2 - pqC3 * root), 1 / pqM1);
}

double pqEncode(double linear)
{
    const double slopeAtOne = pqPeak / (pqM1 * pqM2) * (1 / (1 - pqC1) + pqC3 / (pqC2 - pqC3));
    if (linear > pqPeak) return 1 + (linear - pqPeak) / slopeAtOne;
    if (linear == 0) return 0;
    const double y = std::pow(linear / pqPeak, pqM1);
    return std::pow((pqC1 + pqC2 * y) / (1 + pqC3 * y), pqM2);
}

// ITU-R BT.2100-2, table 5.
constexpr double hlgA = 0.17883277, hlgB = 1 - 4 * hlgA;
const double hlgC = 0.5 - hlgA * std::log(4 * hlgA);

double hlgDecode(double code) { return code <= 0.5 ? code * code / 3 : (std::exp((code - hlgC) / hlgA) + hlgB) / 12; }

double hlgEncode(double linear)
{
    return linear <= 1.0 / 12 ? std::sqrt(3 * linear) : hlgA * std::log(12 * linear - hlgB) + hlgC;
}

}  // namespace

std::optional<PowerCurve> powerOf(Curve curve) noexcept
{
    if (curve == Curve::Linear) return PowerCurve();
    return isPower(curve) ? std::optional(powerCurve(curve)) : std::nullopt;
}

double decodeCurveExact(Curve curve, double code) noexcept
{
    if (isLogarithm(curve)) return decodeLogarithm(curve, code);
    const double size = std::fabs(code);
    switch (curve) {
        case Curve::Linear: return code;
        case Curve::Pq: return std::copysign(pqDecode(size), code);
        case Curve::Hlg: return std::copysign(hlgDecode(size), code);
        default: {
            const PowerCurve p = powerCurve(curve);
            return std::copysign(size <= p.toe ? size / p.slope : std::pow((size + p.offset) / (1 + p.offset), p.power),
                                 code);
        }
    }
}

double encodeCurveExact(Curve curve, double linear) noexcept
{
    if (isLogarithm(curve)) return encodeLogarithm(curve, linear);
    const double size = std::fabs(linear);
    switch (curve) {
        case Curve::Linear: return linear;
        case Curve::Pq: return std::copysign(pqEncode(size), linear);
        case Curve::Hlg: return std::copysign(hlgEncode(size), linear);
        default: {
            const PowerCurve p = powerCurve(curve);
            const double code =
                size <= p.toe / p.slope ? size * p.slope : std::pow(size, 1 / p.power) * (1 + p.offset) - p.offset;
            return std::copysign(code, linear);
        }
    }
}

void decodeCurve(Curve curve, float* values, std::size_t count) noexcept
{
    if (curve == Curve::Linear) return;
    if (!isPower(curve)) {
        for (std::size_t i = 0; i < count; ++i) values[i] = float(decodeCurveExact(curve, values[i]));
        return;
    }
    const PowerCurve p = powerCurve(curve);
    decodePower(values, count, float(p.power), float(p.offset), float(p.slope), float(p.toe));
}

void encodeCurve(Curve curve, float* values, std::size_t count) noexcept
{
    if (curve == Curve::Linear) return;
    if (!isPower(curve)) {
        for (std::size_t i = 0; i < count; ++i) values[i] = float(encodeCurveExact(curve, values[i]));
        return;
    }
    const PowerCurve p = powerCurve(curve);
    encodePower(values, count, float(p.power), float(p.offset), float(p.slope), float(p.toe));
}

}  // namespace virga::io
