#include "io/Curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

namespace virga::io {
namespace {

constexpr Curve all[] = {Curve::Linear,       Curve::Srgb,
                         Curve::Rec709Camera, Curve::Bt1886,
                         Curve::Gamma22,      Curve::Gamma26,
                         Curve::Gamma28,      Curve::AdobeRgb,
                         Curve::Pq,           Curve::Hlg,
                         Curve::Cineon,       Curve::AcesCc,
                         Curve::AcesCct,      Curve::ArriLogC3,
                         Curve::ArriLogC4,    Curve::SLog3,
                         Curve::CanonLog2,    Curve::CanonLog3,
                         Curve::VLog,         Curve::Log3G10,
                         Curve::BmdFilmGen5,  Curve::DavinciIntermediate};

std::vector<float> codes(double from, double to, int count)
{
    std::vector<float> values;
    for (int i = 0; i < count; ++i) values.push_back(float(from + (to - from) * i / (count - 1)));
    return values;
}

// What Curve.h states of the fast float forms: absolute for codes 0..1, of the value above; 2^-24 is float's own
// rounding.
TEST(Curve, FastFormsFollowTheExactOnes)
{
    for (const Curve curve : all) {
        const bool isPower = curve < Curve::Pq;
        const std::vector<float> in = codes(-0.5, 4, 65536);
        std::vector<float> out = in;
        decodeCurve(curve, out.data(), out.size());
        for (std::size_t i = 0; i < in.size(); ++i) {
            const double exact = decodeCurveExact(curve, in[i]), size = std::fabs(exact);
            const double allowed = !isPower ? std::ldexp(size, -24) : in[i] <= 1 ? 2.5e-7 : 7e-7 * size;
            ASSERT_NEAR(out[i], exact, allowed) << int(curve) << " " << in[i];
        }
        std::vector<float> back = out;
        encodeCurve(curve, back.data(), back.size());
        for (std::size_t i = 0; i < in.size(); ++i) {
            const double exact = encodeCurveExact(curve, out[i]), size = std::fabs(exact);
            const double allowed = !isPower ? std::ldexp(size, -24) : in[i] <= 1 ? 1.5e-7 : 3e-7 * size;
            ASSERT_NEAR(back[i], exact, allowed) << int(curve) << " " << out[i];
        }
    }
}

// The documents' own formulas and constants, written down once more from them, in long double.
namespace published {

using Real = long double;

Real log10Of(Real x) { return std::log10(x); }
Real power10(Real x) { return std::pow(Real(10), x); }

struct Case {
    const char* document;
    Curve curve;
    Real (*toLight)(Real code);
    Real (*toCode)(Real light);
    Real leastCode, mostCode;  ///< what is defined
    Real tolerance = 1e-12L;   ///< more where the document's rounded constants leave a step between its pieces
};

const Case cases[] = {
    {"IEC 61966-2-1:1999, 5.2", Curve::Srgb,
     [](Real v) { return v <= 0.04045L ? v / 12.92L : std::pow((v + 0.055L) / 1.055L, 2.4L); },
     [](Real l) { return l <= 0.0031308L ? 12.92L * l : 1.055L * std::pow(l, 1 / 2.4L) - 0.055L; }, 0, 4, 3e-8L},
    {"ITU-R BT.2020-2, table 4", Curve::Rec709Camera,
     [](Real v) {
         const Real alpha = 1.09929682680944L, beta = 0.018053968510807L;
         return v < 4.5L * beta ? v / 4.5L : std::pow((v + alpha - 1) / alpha, 1 / 0.45L);
     },
     [](Real l) {
         const Real alpha = 1.09929682680944L, beta = 0.018053968510807L;
         return l < beta ? 4.5L * l : alpha * std::pow(l, 0.45L) - (alpha - 1);
     },
     0, 4},
    {"ITU-R BT.1886, annex 1, Lb = 0, Lw = 1", Curve::Bt1886, [](Real v) { return std::pow(v, 2.4L); },
     [](Real l) { return std::pow(l, 1 / 2.4L); }, 0, 4},
    {"ITU-T H.273, transfer 4", Curve::Gamma22, [](Real v) { return std::pow(v, 2.2L); },
     [](Real l) { return std::pow(l, 1 / 2.2L); }, 0, 4},
    {"SMPTE RP 431-2:2011, 6.1", Curve::Gamma26, [](Real v) { return std::pow(v, 2.6L); },
     [](Real l) { return std::pow(l, 1 / 2.6L); }, 0, 4},
    {"ITU-T H.273, transfer 5", Curve::Gamma28, [](Real v) { return std::pow(v, 2.8L); },
     [](Real l) { return std::pow(l, 1 / 2.8L); }, 0, 4},
    {"Adobe RGB (1998), 4.3.1.2", Curve::AdobeRgb, [](Real v) { return std::pow(v, 2.19921875L); },
     [](Real l) { return std::pow(l, 1 / 2.19921875L); }, 0, 4},
    {"SMPTE ST 2084:2014, 4 and 5", Curve::Pq,
     [](Real n) {
         const Real m1 = 0.1593017578125L, m2 = 78.84375L, c1 = 0.8359375L, c2 = 18.8515625L, c3 = 18.6875L;
         const Real p = std::pow(n, 1 / m2);
         return 100 * std::pow(std::max(p - c1, Real(0)) / (c2 - c3 * p), 1 / m1);
     },
     [](Real l) {
         const Real m1 = 0.1593017578125L, m2 = 78.84375L, c1 = 0.8359375L, c2 = 18.8515625L, c3 = 18.6875L;
         const Real y = std::pow(l / 100, m1);
         return std::pow((c1 + c2 * y) / (1 + c3 * y), m2);
     },
     1e-6L, 1, 1e-11L},
    {"ITU-R BT.2100-2, table 5", Curve::Hlg,
     [](Real v) {
         const Real a = 0.17883277L, b = 1 - 4 * a, c = 0.5L - a * std::log(4 * a);
         return v <= 0.5L ? v * v / 3 : (std::exp((v - c) / a) + b) / 12;
     },
     [](Real e) {
         const Real a = 0.17883277L, b = 1 - 4 * a, c = 0.5L - a * std::log(4 * a);
         return e <= 1 / 12.0L ? std::sqrt(3 * e) : a * std::log(12 * e - b) + c;
     },
     0, 2},
    {"Kodak 1995, black 95, white 685, 0.002 a code, 0.6", Curve::Cineon,
     [](Real v) {
         const Real black = power10((95 - 685) * 0.002L / 0.6L);
         return (power10((1023 * v - 685) * 0.002L / 0.6L) - black) / (1 - black);
     },
     [](Real l) {
         const Real black = power10((95 - 685) * 0.002L / 0.6L);
         return (685 + log10Of(l * (1 - black) + black) * 0.6L / 0.002L) / 1023;
     },
     0, 1.5L},
    {"AMPAS S-2014-003, 4.4", Curve::AcesCc,
     [](Real v) {
         return v <= (9.72L - 15) / 17.52L ? (std::exp2(v * 17.52L - 9.72L) - std::exp2(Real(-16))) * 2
                                           : std::exp2(v * 17.52L - 9.72L);
     },
     [](Real l) {
         return l < std::exp2(Real(-15)) ? (std::log2(std::exp2(Real(-16)) + l * 0.5L) + 9.72L) / 17.52L
                                         : (std::log2(l) + 9.72L) / 17.52L;
     },
     -0.358447L, 1.468L},
    {"AMPAS S-2016-001, 4.4", Curve::AcesCct,
     [](Real v) {
         return v > 0.155251141552511L ? std::exp2(v * 17.52L - 9.72L) : (v - 0.0729055341958355L) / 10.5402377416545L;
     },
     [](Real l) {
         return l <= 0.0078125L ? 10.5402377416545L * l + 0.0729055341958355L : (std::log2(l) + 9.72L) / 17.52L;
     },
     -0.3L, 1.468L},
    {"ARRI, ALEXA Log C Curve: Usage in VFX, 2017, EI 800", Curve::ArriLogC3,
     [](Real t) {
         const Real cut = 0.010591L, a = 5.555556L, b = 0.052272L, c = 0.247190L, d = 0.385537L, e = 5.367655L,
                    f = 0.092809L;
         return t > e * cut + f ? (power10((t - d) / c) - b) / a : (t - f) / e;
     },
     [](Real x) {
         const Real cut = 0.010591L, a = 5.555556L, b = 0.052272L, c = 0.247190L, d = 0.385537L, e = 5.367655L,
                    f = 0.092809L;
         return x > cut ? c * log10Of(a * x + b) + d : e * x + f;
     },
     -0.3L, 1.2L, 1e-6L},
    {"ARRI LogC4 Logarithmic Color Space Specification, 2022, 4", Curve::ArriLogC4,
     [](Real v) {
         const Real a = (std::exp2(Real(18)) - 16) / 117.45L, b = (1023 - 95) / 1023.0L, c = 95 / 1023.0L;
         const Real s = 7 * std::log(Real(2)) * std::exp2(7 - 14 * c / b) / (a * b);
         const Real t = (std::exp2(14 * (-c / b) + 6) - 64) / a;
         return v >= 0 ? (std::exp2(14 * (v - c) / b + 6) - 64) / a : v * s + t;
     },
     [](Real l) {
         const Real a = (std::exp2(Real(18)) - 16) / 117.45L, b = (1023 - 95) / 1023.0L, c = 95 / 1023.0L;
         const Real s = 7 * std::log(Real(2)) * std::exp2(7 - 14 * c / b) / (a * b);
         const Real t = (std::exp2(14 * (-c / b) + 6) - 64) / a;
         return l >= t ? (std::log2(a * l + 64) - 6) / 14 * b + c : (l - t) / s;
     },
     -0.3L, 1.2L},
    {"Sony, Technical Summary for S-Gamut3.Cine/S-Log3 and S-Gamut3/S-Log3, appendix", Curve::SLog3,
     [](Real v) {
         return v >= 171.2102946929L / 1023 ? power10((v * 1023 - 420) / 261.5L) * (0.18L + 0.01L) - 0.01L
                                            : (v * 1023 - 95) * 0.01125L / (171.2102946929L - 95);
     },
     [](Real l) {
         return l >= 0.01125L ? (420 + log10Of((l + 0.01L) / (0.18L + 0.01L)) * 261.5L) / 1023
                              : (l * (171.2102946929L - 95) / 0.01125L + 95) / 1023;
     },
     -0.3L, 1.2L, 1e-10L},
    {"Canon Log Gamma Curves, 2018, Canon Log 2", Curve::CanonLog2,
     [](Real v) {
         const Real x = v < 0.092864125L ? -(power10((0.092864125L - v) / 0.24136077L) - 1) / 87.099375L
                                         : (power10((v - 0.092864125L) / 0.24136077L) - 1) / 87.099375L;
         return 0.9L * x;
     },
     [](Real l) {
         const Real x = l / 0.9L;
         return x < 0 ? -0.24136077L * log10Of(1 - 87.099375L * x) + 0.092864125L
                      : 0.24136077L * log10Of(87.099375L * x + 1) + 0.092864125L;
     },
     -0.3L, 1.2L},
    {"Canon Log Gamma Curves, 2018, Canon Log 3", Curve::CanonLog3,
     [](Real v) {
         const Real x = v < 0.097465473L   ? -(power10((0.12783901L - v) / 0.36726845L) - 1) / 14.98325L
                        : v <= 0.15277891L ? (v - 0.12512219L) / 1.9754798L
                                           : (power10((v - 0.12240537L) / 0.36726845L) - 1) / 14.98325L;
         return 0.9L * x;
     },
     [](Real l) {
         const Real x = l / 0.9L;
         return x < -0.014L   ? -0.36726845L * log10Of(1 - 14.98325L * x) + 0.12783901L
                : x <= 0.014L ? 1.9754798L * x + 0.12512219L
                              : 0.36726845L * log10Of(14.98325L * x + 1) + 0.12240537L;
     },
     -0.3L, 1.2L, 1e-7L},
    {"Panasonic, V-Log/V-Gamut Reference Manual, 2014", Curve::VLog,
     [](Real v) { return v < 0.181L ? (v - 0.125L) / 5.6L : power10((v - 0.598206L) / 0.241514L) - 0.00873L; },
     [](Real l) { return l < 0.01L ? 5.6L * l + 0.125L : 0.241514L * log10Of(l + 0.00873L) + 0.598206L; }, -0.3L, 1.2L,
     1e-5L},
    {"RED, White Paper on REDWideGamutRGB and Log3G10, 2017", Curve::Log3G10,
     [](Real v) { return v < 0 ? v / 15.1927L - 0.01L : (power10(v / 0.224282L) - 1) / 155.975327L - 0.01L; },
     [](Real l) { return l + 0.01L < 0 ? (l + 0.01L) * 15.1927L : 0.224282L * log10Of((l + 0.01L) * 155.975327L + 1); },
     -0.3L, 1.2L},
    {"Blackmagic, Generation 5 Color Science, 2021", Curve::BmdFilmGen5,
     [](Real v) {
         return v < 8.283605932402494L * 0.005L + 0.09246575342465753L
                    ? (v - 0.09246575342465753L) / 8.283605932402494L
                    : std::exp((v - 0.5300133392291939L) / 0.08692876065491224L) - 0.005494072432257808L;
     },
     [](Real l) {
         return l < 0.005L ? 8.283605932402494L * l + 0.09246575342465753L
                           : 0.08692876065491224L * std::log(l + 0.005494072432257808L) + 0.5300133392291939L;
     },
     -0.3L, 1.2L},
    {"Blackmagic, DaVinci Resolve 17 Wide Gamut Intermediate, 2021", Curve::DavinciIntermediate,
     [](Real v) { return v > 0.02740668L ? std::exp2(v / 0.07329248L - 7) - 0.0075L : v / 10.44426855L; },
     [](Real l) { return l > 0.00262409L ? (std::log2(l + 0.0075L) + 7) * 0.07329248L : l * 10.44426855L; }, -0.3L,
     1.2L, 1e-8L},
};

}  // namespace published

// Over all that a document defines, codes beyond 0..1 included; both ways apart, so that they cannot be wrong together.
TEST(Curve, FollowsTheDocuments)
{
    constexpr int steps = 20011;
    for (const published::Case& c : published::cases) {
        SCOPED_TRACE(c.document);
        for (int i = 0; i <= steps; ++i) {
            const double code = double(c.leastCode + (c.mostCode - c.leastCode) * i / steps);
            const double light = double(c.toLight(code));
            const double scale = std::max(1.0, std::fabs(light));
            ASSERT_NEAR(decodeCurveExact(c.curve, code), light, double(c.tolerance) * scale) << code;
            ASSERT_NEAR(encodeCurveExact(c.curve, light), double(c.toCode(light)), double(c.tolerance)) << light;
            ASSERT_NEAR(encodeCurveExact(c.curve, decodeCurveExact(c.curve, code)), code, 1e-5) << code;
        }
    }
    for (const Curve curve : all) {
        const bool isChecked = std::any_of(std::begin(published::cases), std::end(published::cases),
                                           [&](const published::Case& c) { return c.curve == curve; });
        EXPECT_TRUE(isChecked || curve == Curve::Linear) << int(curve);
    }
}

// Published pairs, so that formula and fast form cannot be wrong together.
TEST(Curve, KnowsPublishedValues)
{
    EXPECT_NEAR(decodeCurveExact(Curve::Srgb, 0.5), 0.21404114, 1e-7);          // IEC 61966-2-1
    EXPECT_NEAR(encodeCurveExact(Curve::Rec709Camera, 0.18), 0.409, 5e-4);      // BT.709 item 1.2, three digits
    EXPECT_NEAR(decodeCurveExact(Curve::Pq, 0.5080784), 1.0, 1e-4);             // ST 2084: 100 cd/m2 is code 0.508
    EXPECT_NEAR(decodeCurveExact(Curve::Hlg, 0.75), 0.26496256, 1e-6);          // BT.2100: 75 % is 0.265
    EXPECT_NEAR(encodeCurveExact(Curve::ArriLogC3, 0.18), 400.0 / 1023, 5e-4);  // ARRI: grey is code 400
    EXPECT_NEAR(encodeCurveExact(Curve::ArriLogC4, 0.18), 0.27836, 1e-4);       // ARRI: 27.8 %
    EXPECT_NEAR(encodeCurveExact(Curve::SLog3, 0.18), 420.0 / 1023, 1e-12);     // Sony: grey is code 420
    EXPECT_NEAR(encodeCurveExact(Curve::VLog, 0.18), 433.0 / 1023, 5e-4);       // Panasonic: 433
    EXPECT_NEAR(encodeCurveExact(Curve::Log3G10, 0.18), 1.0 / 3, 1e-5);         // RED: grey is a third
    EXPECT_NEAR(encodeCurveExact(Curve::CanonLog2, 0.18), 0.39825469, 1e-6);    // Canon: 39.8 %
    EXPECT_NEAR(encodeCurveExact(Curve::CanonLog3, 0.18), 0.34338967, 1e-6);    // Canon: 34.3 %
    EXPECT_NEAR(encodeCurveExact(Curve::BmdFilmGen5, 0.18), 0.38355, 1e-4);     // Blackmagic: 38.4 %
    EXPECT_NEAR(encodeCurveExact(Curve::DavinciIntermediate, 0.18), 0.336043, 1e-6);  // Blackmagic: 33.6 %
    EXPECT_NEAR(encodeCurveExact(Curve::AcesCct, 0.18), 0.4135884, 1e-6);             // S-2016-001, annex
    EXPECT_NEAR(decodeCurveExact(Curve::Cineon, 685.0 / 1023), 1.0, 1e-12);           // white
    EXPECT_NEAR(decodeCurveExact(Curve::Cineon, 95.0 / 1023), 0.0, 1e-12);            // black
}

// YCbCr reaches from about -0.8 to 2: all of it has to come back to far below half a 16-bit code. Light codes of
// logarithms overflow where those of displays do not, so they go up to 2.
TEST(Curve, ComesBackFarOutsideTheCube)
{
    for (const Curve curve : all) {
        const std::vector<float> in = codes(-1.5, curve >= Curve::Cineon ? 2 : 2.5, 100001);
        std::vector<float> out = in;
        decodeCurve(curve, out.data(), out.size());
        encodeCurve(curve, out.data(), out.size());
        for (std::size_t i = 0; i < in.size(); ++i) ASSERT_NEAR(out[i], in[i], 2.0 / 65535 / 8) << int(curve);
    }
}

// Light that rings below black or is far brighter than white comes back, to a code's worth.
TEST(Curve, NegativeAndBrightLightComesBack)
{
    for (const Curve curve : all) {
        for (const float light : {-2.0f, -0.2f, -1e-3f, -1e-5f, 0.0f, 1e-5f, 1e-3f, 0.18f, 1.0f, 50.0f, 1000.0f}) {
            float value = light;
            encodeCurve(curve, &value, 1);
            ASSERT_TRUE(std::isfinite(value)) << int(curve) << " " << light;
            decodeCurve(curve, &value, 1);
            ASSERT_NEAR(value, light, 2e-6 + 1e-5 * std::fabs(double(light))) << int(curve);
        }
    }
}

// Brighter is brighter, below black too: no extension turns back.
TEST(Curve, NeverTurnsBack)
{
    for (const Curve curve : all) {
        double before = -std::numeric_limits<double>::infinity();
        for (int i = -1500; i <= 2000; ++i) {
            const double light = decodeCurveExact(curve, i / 1000.0);
            ASSERT_GT(light, before) << int(curve) << " " << i;
            before = light;
        }
    }
}

TEST(Curve, KeepsWhatIsNoNumber)
{
    const float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
    for (const Curve curve : {Curve::Linear, Curve::Srgb, Curve::Rec709Camera, Curve::Bt1886}) {
        float values[9] = {nan, infinity, -infinity, nan, infinity, -infinity, 0.0f, -0.0f, nan};
        encodeCurve(curve, values, 9);
        decodeCurve(curve, values, 9);
        EXPECT_TRUE(std::isnan(values[0]) && std::isnan(values[3]) && std::isnan(values[8]));
        EXPECT_EQ(values[1], infinity);
        EXPECT_EQ(values[2], -infinity);
        EXPECT_EQ(values[6], 0.0f);
        EXPECT_EQ(values[7], 0.0f);
    }
}

}  // namespace
}  // namespace virga::io
