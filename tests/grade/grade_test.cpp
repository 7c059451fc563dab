#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/Error.h"
#include "core/Parallel.h"
#include "grade/ColorTransfer.h"
#include "grade/Darken.h"

namespace virga::grade {
namespace {

using Color = std::array<double, 3>;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

// Three normal deviates, the same for the same number.
Color normals(unsigned n)
{
    Color out{};
    std::uint64_t state = n * 2654435761u + 12345;
    for (double& value : out) {
        for (int i = 0; i < 12; ++i) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            value += double(state >> 40) * 0x1p-24;
        }
        value -= 6;
    }
    return out;
}

ImageF picture(int width, int height, const std::function<Color(unsigned)>& color)
{
    ImageF image(width, height, 3);
    for (int i = 0; i < width * height; ++i) {
        const Color c = color(unsigned(i));
        for (int k = 0; k < 3; ++k) image.at(i % width, i / width, k) = float(c[k]);
    }
    return image;
}

// A lognormal cloud of colours, whose channels hang together.
Color cloud(unsigned n, const Color& middle, double spread, double chroma)
{
    const Color z = normals(n);
    Color c;
    for (int k = 0; k < 3; ++k) c[k] = middle[k] * std::exp(spread * z[0] + chroma * z[k == 0 ? 1 : 2]);
    return c;
}

TEST(Darken, BlendsWithLuminanceThenScales)
{
    const Color c{0.9, 0.3, 4};
    const double luminance = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    for (double s = 0; s <= 1; s += 0.25) {
        const Color out = darkened(c, {s, 0});
        EXPECT_NEAR(0.2126 * out[0] + 0.7152 * out[1] + 0.0722 * out[2], luminance, 1e-12);  // luminance stays
        EXPECT_NEAR(out[2] - out[1], (1 - s) * (c[2] - c[1]), 1e-12);                        // colour shrinks
        const Color twice = darkened({2 * c[0], 2 * c[1], 2 * c[2]}, {s, 0.3});
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(twice[k], 2 * 0.7 * out[k], 1e-12);  // linear, and scaled
    }
    EXPECT_EQ(darkened({kInf, 1, kNan}, {})[1], 1);
    EXPECT_TRUE(Darkening().isIdentity());
    EXPECT_FALSE((Darkening{0, 0.1}).isIdentity());
}

TEST(ColorLut, EncodingIsMonotonicSmoothAndInvertible)
{
    ColorLut lut;
    lut.maximum = 16;
    EXPECT_EQ(encode(lut, 0), 0);
    EXPECT_NEAR(encode(lut, 16), 1, 1e-12);
    double before = -kInf;
    for (const double c : {-100.0, -0.5, -1e-6, 0.0, 1e-6, 0.18, 1.0, 15.9, 16.0, 1e4, 1e9}) {
        const double e = encode(lut, c);
        EXPECT_GT(e, before);
        EXPECT_NEAR(decode(lut, e), c, 1e-9 * std::max(1.0, std::abs(c)));
        before = e;
    }
    EXPECT_NEAR(encode(lut, 1e-7) / 1e-7, -encode(lut, -1e-7) / 1e-7, 1e-3);  // one slope on both sides of 0
}

TEST(ColorLut, NodesInterpolateAndTheEdgeContinues)
{
    ColorLut lut;
    lut.size = 3;
    lut.maximum = 8;
    lut.rgb.resize(81);
    for (int i = 0; i < 81; ++i) lut.rgb[i] = float(normals(unsigned(i))[0] * 0.02);
    for (int node = 0; node < 27; ++node) {
        Color e{node % 3 / 2.0, node / 3 % 3 / 2.0, node / 9 / 2.0};
        const Color out = apply(lut, {decode(lut, e[0]), decode(lut, e[1]), decode(lut, e[2])});
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(encode(lut, out[k]), e[k] + lut.rgb[3 * node + k], 1e-9);
    }
    const Color middle = apply(lut, {decode(lut, 0.25), 0, 0});
    EXPECT_NEAR(encode(lut, middle[1]), 0.5 * (lut.rgb[1] + lut.rgb[4]), 1e-9);
    // Above the table the gain stays that of its edge (delta aside), however bright; NaN and infinity keep to
    // themselves.
    const Color bright = apply(lut, {8e4, 8e4, 8e4}), brighter = apply(lut, {8e5, 8e5, 8e5});
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(brighter[k] / bright[k], 10, 1e-4);
    const Color odd = apply(lut, {kNan, 0.5, kInf});
    EXPECT_TRUE(std::isnan(odd[0]));
    EXPECT_TRUE(std::isfinite(odd[1]));
    EXPECT_EQ(odd[2], kInf);
}

TEST(ColorTransfer, PlateAsItsOwnReferenceIsTheIdentity)
{
    const ImageF image = picture(200, 150, [](unsigned n) { return cloud(n, {0.3, 0.25, 0.2}, 1, 0.3); });
    const ColorLut lut = makeColorTransfer({image}, image);
    for (const float d : lut.rgb) EXPECT_NEAR(d, 0, 1e-6);
}

// The mean and the spread of the graded plate are the reference's, in stops, and colours that were not sampled follow.
TEST(ColorTransfer, GivesTheReferencesDistribution)
{
    const ImageF plate = picture(240, 160, [](unsigned n) { return cloud(n, {0.4, 0.35, 0.15}, 0.8, 0.25); });
    const ImageF still = picture(160, 120, [](unsigned n) { return cloud(n + 99999, {0.1, 0.14, 0.2}, 0.5, 0.15); });
    const ColorLut lut = makeColorTransfer({plate}, still);
    Color mean{}, square{}, wantedMean{}, wantedSquare{};
    for (int i = 0; i < 240 * 160; ++i) {
        const float* p = plate.pixel(i % 240, i / 240);
        const Color out = apply(lut, {p[0], p[1], p[2]});
        for (int k = 0; k < 3; ++k) mean[k] += std::log2(out[k]), square[k] += std::pow(std::log2(out[k]), 2);
    }
    for (int i = 0; i < 160 * 120; ++i)
        for (int k = 0; k < 3; ++k) {
            const double stops = std::log2(still.at(i % 160, i / 160, k));
            wantedMean[k] += stops, wantedSquare[k] += stops * stops;
        }
    for (int k = 0; k < 3; ++k) {
        const double m = mean[k] / (240 * 160), w = wantedMean[k] / (160 * 120);
        EXPECT_NEAR(m, w, 0.05);
        EXPECT_NEAR(std::sqrt(square[k] / (240 * 160) - m * m), std::sqrt(wantedSquare[k] / (160 * 120) - w * w), 0.08);
    }
}

TEST(ColorTransfer, HalfTheExposureHalvesTheLight)
{
    const ImageF plate = picture(240, 160, [](unsigned n) { return cloud(n, {2, 2, 2}, 0.7, 0.2); });
    ImageF still = plate;
    for (float& value : still.values()) value *= 0.5f;
    const ColorLut lut = makeColorTransfer({plate}, still);
    for (const double c : {0.8, 2.0, 5.0}) {
        const Color out = apply(lut, {c, c, c});
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(out[k], c / 2, 0.03 * c);
    }
    ColorTransferOptions options;
    options.strength = 0;
    EXPECT_TRUE(makeColorTransfer({plate}, still, options).isIdentity());
    options.strength = 0.5;
    EXPECT_NEAR(apply(makeColorTransfer({plate}, still, options), {2, 2, 2})[0], std::sqrt(0.5) * 2, 0.06);
}

// A flat sky against a picture of all colours: the table must neither tear its noise apart nor fold back.
TEST(ColorTransfer, NeverStretchesOrSolarises)
{
    const auto noisySky = [](unsigned n) { return cloud(n, {0.5, 0.6, 0.8}, 0.01, 0.01); };
    const auto twoTones = [](unsigned n) { return cloud(n, {n % 2 ? 0.02 : 3.0, 0.3, n % 3 ? 0.05 : 1.0}, 0.1, 0.1); };
    const auto wild = [](unsigned n) { return cloud(n, {0.2, 0.2, 0.2}, 1.5, 0.8); };
    const auto black = [](unsigned) { return Color{}; };
    ColorTransferOptions options;
    options.size = 17;
    options.samples = 4000;
    const std::vector<std::function<Color(unsigned)>> pictures{noisySky, twoTones, wild, black};
    for (const auto& from : pictures)
        for (const auto& to : pictures) {
            const ImageF plate = picture(80, 60, from), still = picture(60, 80, to);
            const ColorLut lut = makeColorTransfer({plate}, still, options);
            const int size = lut.size;
            double least = 1, most = 1;
            const int steps[7][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}, {1, -1, 0}, {0, 1, -1}, {1, 0, -1}};
            for (int node = 0; node < size * size * size; ++node) {
                const int place[3] = {node % size, node / size % size, node / size / size};
                for (int k = 0; k < 3; ++k) {
                    ASSERT_TRUE(std::isfinite(lut.rgb[3 * node + k]));
                    ASSERT_GE(place[k] + lut.rgb[3 * node + k] * (size - 1), -1e-4);  // no negative light
                }
                for (const auto& step : steps) {
                    int next = 0, squared = 0;
                    bool inside = true;
                    for (int k = 2; k >= 0; --k) {
                        const int to = place[k] + step[k];
                        inside = inside && to >= 0 && to < size;
                        next = next * size + to;
                        squared += step[k] * step[k];
                    }
                    if (!inside) continue;
                    const auto clipped = [&](int n) {  // what would be darker than black is black
                        bool any = false;
                        for (int k = 0, rest = n; k < 3; ++k, rest /= size)
                            any = any || rest % size + lut.rgb[3 * n + k] * (size - 1) < 1e-4;
                        return any;
                    };
                    if (clipped(node) || clipped(next)) continue;
                    double along = 0;  // how far the colour goes along the step
                    for (int k = 0; k < 3; ++k)
                        along += step[k] * (step[k] + (lut.rgb[3 * next + k] - lut.rgb[3 * node + k]) * (size - 1));
                    least = std::min(least, along / squared), most = std::max(most, along / squared);
                }
            }
            EXPECT_GE(least, -1e-4);
            EXPECT_LE(most, options.maxSlope + 1e-4);
        }
}

TEST(ColorTransfer, SameTableOnAnyThreads)
{
    const ImageF plate = picture(80, 60, [](unsigned n) { return cloud(n, {0.4, 0.3, 0.2}, 0.8, 0.3); });
    const ImageF still = picture(80, 60, [](unsigned n) { return cloud(n + 7777, {0.2, 0.3, 0.3}, 0.5, 0.1); });
    const ColorLut many = makeColorTransfer({plate, still}, still);
    const ThreadLimit one(1);
    EXPECT_EQ(many.rgb, makeColorTransfer({plate, still}, still).rgb);
}

TEST(ColorTransfer, OddPixelsAndOptions)
{
    ImageF plate = picture(40, 40, [](unsigned n) { return cloud(n, {0.4, 0.3, 0.2}, 0.8, 0.3); });
    const ImageF still = plate;
    plate.at(3, 3, 0) = float(kNan);
    plate.at(4, 3, 1) = float(kInf);
    plate.at(5, 3, 2) = -3;
    plate.at(6, 3, 2) = 1e6f;
    for (const float d : makeColorTransfer({plate}, still).rgb) EXPECT_TRUE(std::isfinite(d));

    EXPECT_THROW(makeColorTransfer({ImageF(8, 8, 3, float(kNan))}, still), Error);
    EXPECT_THROW(makeColorTransfer({}, still), Error);
    EXPECT_THROW(makeColorTransfer({plate}, ImageF(8, 8, 1, 0.5f)), Error);
    ColorTransferOptions options;
    options.strength = kNan;
    try {
        makeColorTransfer({plate}, still, options);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::InvalidArgument);
        EXPECT_NE(std::string(error.what()).find("strength"), std::string::npos);
    }
}

}  // namespace
}  // namespace virga::grade
