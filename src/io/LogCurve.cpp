#include "io/LogCurve.h"

#include <cmath>
#include <numbers>

namespace virga::io {

namespace {

using std::numbers::ln10;
using std::numbers::ln2;

/// linear < cut: code = slope * linear + straight; from there code = scale * ln(gain * linear + shift) + offset.
/// Makers print the cut in light and in code, and rounded: the two pieces of some miss each other by up to 1e-5.
struct LogCurve {
    double scale, offset, gain, shift;
    double cut, codeCut;
    double slope, straight;
};

/// A logarithm without a straight piece, continued below `cut` by its tangent there.
LogCurve withTangentBelow(double cut, double scale, double offset, double gain, double shift)
{
    const double codeCut = scale * std::log(gain * cut + shift) + offset;
    const double slope = scale * gain / (gain * cut + shift);
    return {scale, offset, gain, shift, cut, codeCut, slope, codeCut - slope * cut};
}

/// "Conversion of 10-bit Log Film Data to 8-bit Linear or Video Data", Kodak 1995, without soft clip.
LogCurve cineon()
{
    const double codes = 1023, black = 95, white = 685, codesPerDecade = 300;
    const double flare = std::pow(10, (black - white) / codesPerDecade);
    const double cut = (std::pow(10, -white / codesPerDecade) - flare) / (1 - flare);
    return withTangentBelow(cut, codesPerDecade / codes / ln10, white / codes, 1 - flare, flare);
}

/// S-2014-003 has another logarithm under 2^-15, which reaches light 0 with a finite slope.
constexpr double accScale = 1 / (17.52 * ln2), accOffset = 9.72 / 17.52, accJoin = 0x1p-15, accToe = 0x1p-16;
LogCurve acesCc() { return {accScale, accOffset, 1, 0, accJoin, (9.72 - 15) / 17.52, 0, 0}; }
LogCurve acesCcToe() { return withTangentBelow(0, accScale, accOffset, 0.5, accToe); }

LogCurve acesCct()
{
    return {accScale, accOffset, 1, 0, 0.0078125, 0.155251141552511, 10.5402377416545, 0.0729055341958355};
}

LogCurve arriLogC3()
{
    const double cut = 0.010591, a = 5.555556, b = 0.052272, c = 0.247190, d = 0.385537, e = 5.367655, f = 0.092809;
    return {c / ln10, d, a, b, cut, e * cut + f, e, f};
}

LogCurve arriLogC4()
{
    const double a = (std::exp2(18) - 16) / 117.45, b = (1023.0 - 95) / 1023, c = 95.0 / 1023;
    const double s = 7 * ln2 * std::exp2(7 - 14 * c / b) / (a * b), t = (std::exp2(14 * (-c / b) + 6) - 64) / a;
    return {b / (14 * ln2), c - 6 * b / 14, a, 64, t, 0, 1 / s, -t / s};
}

LogCurve sLog3()
{
    const double codes = 1023, grey = 0.18 + 0.01, cut = 0.01125000;
    const double black = 95, joint = 171.2102946929;
    return {261.5 / codes / ln10,          420 / codes,  1 / grey, 0.01 / grey, cut, joint / codes,
            (joint - black) / cut / codes, black / codes};
}

LogCurve vLog() { return {0.241514 / ln10, 0.598206, 1, 0.00873, 0.01, 0.181, 5.6, 0.125}; }

LogCurve log3G10()
{
    const double a = 0.224282, b = 155.975327, c = 0.01, g = 15.1927;
    return {a / ln10, 0, b, b * c + 1, -c, 0, g, g * c};
}

LogCurve bmdFilmGen5()
{
    const double a = 0.08692876065491224, b = 0.005494072432257808, c = 0.5300133392291939;
    const double d = 8.283605932402494, e = 0.09246575342465753, cut = 0.005;
    return {a, c, 1, b, cut, d * cut + e, d, e};
}

LogCurve davinciIntermediate()
{
    const double a = 0.0075, b = 7.0, c = 0.07329248, m = 10.44426855;
    return {c / ln2, b * c, 1, a, 0.00262409, 0.02740668, m, 0};
}

const LogCurve& logCurve(Curve curve)
{
    static const LogCurve curves[] = {cineon(),    LogCurve(), acesCct(),     arriLogC3(),
                                      arriLogC4(), sLog3(),    LogCurve(),    LogCurve(),
                                      vLog(),      log3G10(),  bmdFilmGen5(), davinciIntermediate()};
    return curves[int(curve) - int(Curve::Cineon)];
}

double decode(const LogCurve& c, double code)
{
    return code < c.codeCut ? (code - c.straight) / c.slope
                            : (std::exp((code - c.offset) / c.scale) - c.shift) / c.gain;
}

double encode(const LogCurve& c, double linear)
{
    return linear < c.cut ? c.slope * linear + c.straight : c.scale * std::log(c.gain * linear + c.shift) + c.offset;
}

double decodeAcesCc(double code)
{
    static const LogCurve toe = acesCcToe(), upper = acesCc();
    return decode(code < upper.codeCut ? toe : upper, code);
}

double encodeAcesCc(double linear)
{
    static const LogCurve toe = acesCcToe(), upper = acesCc();
    return encode(linear < upper.cut ? toe : upper, linear);
}

// Canon counts in units of 0.9, so that a white of 90 % is 1.
constexpr double canonUnit = 0.9;

double decodeCanonLog2(double code)
{
    const double a = 0.24136077, b = 87.099375, c = 0.092864125;
    return canonUnit * std::copysign(std::pow(10, std::fabs(code - c) / a) - 1, code - c) / b;
}

double encodeCanonLog2(double linear)
{
    const double a = 0.24136077, b = 87.099375, c = 0.092864125;
    return c + std::copysign(a * std::log10(b * std::fabs(linear / canonUnit) + 1), linear);
}

// Straight around black, with a logarithm above and a mirrored one below.
double decodeCanonLog3(double code)
{
    const double a = 0.36726845, b = 14.98325;
    if (code < 0.097465473) return -canonUnit * (std::pow(10, (0.12783901 - code) / a) - 1) / b;
    if (code <= 0.15277891) return canonUnit * (code - 0.12512219) / 1.9754798;
    return canonUnit * (std::pow(10, (code - 0.12240537) / a) - 1) / b;
}

double encodeCanonLog3(double linear)
{
    const double a = 0.36726845, b = 14.98325, x = linear / canonUnit;
    if (x < -0.014) return 0.12783901 - a * std::log10(1 - b * x);
    if (x <= 0.014) return 1.9754798 * x + 0.12512219;
    return a * std::log10(b * x + 1) + 0.12240537;
}

}  // namespace

double decodeLogarithm(Curve curve, double code) noexcept
{
    switch (curve) {
        case Curve::AcesCc: return decodeAcesCc(code);
        case Curve::CanonLog2: return decodeCanonLog2(code);
        case Curve::CanonLog3: return decodeCanonLog3(code);
        default: return decode(logCurve(curve), code);
    }
}

double encodeLogarithm(Curve curve, double linear) noexcept
{
    switch (curve) {
        case Curve::AcesCc: return encodeAcesCc(linear);
        case Curve::CanonLog2: return encodeCanonLog2(linear);
        case Curve::CanonLog3: return encodeCanonLog3(linear);
        default: return encode(logCurve(curve), linear);
    }
}

}  // namespace virga::io
