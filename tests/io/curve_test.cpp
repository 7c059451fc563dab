#include "io/Curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace virga::io {
namespace {

constexpr Curve all[] = {Curve::Linear,  Curve::Srgb,    Curve::Rec709Camera, Curve::Bt1886, Curve::Gamma22,
                         Curve::Gamma26, Curve::Gamma28, Curve::Pq,           Curve::Hlg,    Curve::Cineon};

std::vector<float> codes(double from, double to, int count)
{
    std::vector<float> values;
    for (int i = 0; i < count; ++i) values.push_back(float(from + (to - from) * i / (count - 1)));
    return values;
}

TEST(Curve, FollowsTheFormula)
{
    for (const Curve curve : all) {
        const std::vector<float> in = codes(0, 1, 65536);
        std::vector<float> out = in;
        decodeCurve(curve, out.data(), out.size());
        const double white = decodeCurveExact(curve, 1);
        for (std::size_t i = 0; i < in.size(); ++i)
            ASSERT_NEAR(out[i], decodeCurveExact(curve, in[i]), 1e-6 * white) << int(curve) << " " << in[i];
        std::vector<float> back = out;
        encodeCurve(curve, back.data(), back.size());
        for (std::size_t i = 0; i < in.size(); ++i)
            ASSERT_NEAR(back[i], encodeCurveExact(curve, out[i]), 1e-6) << int(curve) << " " << out[i];
    }
}

// Published pairs, so that formula and fast form cannot be wrong together.
TEST(Curve, KnowsPublishedValues)
{
    EXPECT_NEAR(decodeCurveExact(Curve::Srgb, 0.5), 0.21404114, 1e-7);       // IEC 61966-2-1
    EXPECT_NEAR(encodeCurveExact(Curve::Rec709Camera, 0.18), 0.409, 5e-4);   // BT.709 item 1.2, three digits
    EXPECT_NEAR(decodeCurveExact(Curve::Pq, 0.5080784), 1.0, 1e-4);          // ST 2084: 100 cd/m2 is code 0.508
    EXPECT_NEAR(decodeCurveExact(Curve::Hlg, 0.75), 0.26496256, 1e-6);       // BT.2100: 75 % is 0.265
    EXPECT_NEAR(decodeCurveExact(Curve::Cineon, 685.0 / 1023), 1.0, 1e-12);  // white
    EXPECT_NEAR(decodeCurveExact(Curve::Cineon, 95.0 / 1023), 0.0, 1e-12);   // black
}

// YCbCr reaches from about -0.8 to 2: all of it has to come back to far below half a 16-bit code.
TEST(Curve, ComesBackFarOutsideTheCube)
{
    for (const Curve curve : all) {
        if (curve == Curve::Cineon) continue;  // never a YCbCr curve
        const std::vector<float> in = codes(-1.5, 2.5, 100001);
        std::vector<float> out = in;
        decodeCurve(curve, out.data(), out.size());
        encodeCurve(curve, out.data(), out.size());
        for (std::size_t i = 0; i < in.size(); ++i) ASSERT_NEAR(out[i], in[i], 2.0 / 65535 / 8) << int(curve);
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
