#include "core/Lanes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

namespace virga::lanes {
namespace {

using Eight = std::array<float, count>;

VIRGA_SIMD void exponentials(const Eight& in, Eight& out) { store(exp(load(in.data())), out.data()); }
VIRGA_SIMD void logarithms(const Eight& in, Eight& out) { store(log(load(in.data())), out.data()); }
VIRGA_SIMD void floors(const Eight& in, Eight& out) { store(floor(load(in.data())), out.data()); }
VIRGA_SIMD void roots(const Eight& in, Eight& out) { store(sqrt(load(in.data())), out.data()); }
VIRGA_SIMD void numbers(const std::array<std::uint32_t, count>& in, Eight& out)
{
    UintVector v;
    std::memcpy(&v, in.data(), sizeof v);
    store(Float(Uint(v)), out.data());
}

Eight from(double first, double step)
{
    Eight values;
    for (int i = 0; i < count; ++i) values[std::size_t(i)] = float(first + i * step);
    return values;
}

TEST(Lanes, ExponentialsAreTheFormulaTo2e7)
{
    double worst = 0;
    for (double x = -87; x < 88; x += 8 * 0.00137) {
        const Eight in = from(x, 0.00137);
        Eight out;
        exponentials(in, out);
        for (std::size_t i = 0; i < count; ++i)
            if (in[i] <= 88) worst = std::max(worst, std::abs(out[i] / std::exp(double(in[i])) - 1));
    }
    EXPECT_LT(worst, 2e-7);
}

TEST(Lanes, ExponentialsStayFinite)
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    Eight out;
    exponentials({-infinity, -1e30f, -100, 0, 88, 100, 1e30f, infinity}, out);
    for (std::size_t i = 0; i < count; ++i) EXPECT_TRUE(std::isfinite(out[i])) << i;
    EXPECT_EQ(out[3], 1.0f);
    EXPECT_LT(out[0], 1e-37f);
}

TEST(Lanes, LogarithmsAreTheFormulaTo2e7)
{
    double worst = 0;
    for (double power = -37; power < 38; power += 8 * 0.00071) {
        Eight in, out;
        for (int i = 0; i < count; ++i) in[std::size_t(i)] = float(std::pow(10.0, power + i * 0.00071));
        logarithms(in, out);
        for (std::size_t i = 0; i < count; ++i) {
            const double exact = std::log(double(in[i]));
            worst = std::max(worst, std::abs(out[i] - exact) / std::max(1.0, std::abs(exact)));
        }
    }
    EXPECT_LT(worst, 2e-7);
}

TEST(Lanes, FloorsRootsAndNumbersAreExact)
{
    Eight out;
    const Eight edges = {-2.0f, -1.5f, -0.0f, 0.25f, 1.0f, 2.75f, -1e9f, 1e9f};
    floors(edges, out);
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(out[i], std::floor(edges[i])) << edges[i];
    const Eight squares = {0, 1, 2, 3.5f, 1e-30f, 1e30f, 144, 0.1f};
    roots(squares, out);
    for (std::size_t i = 0; i < count; ++i) EXPECT_EQ(out[i], std::sqrt(squares[i])) << squares[i];
    numbers({0, 1, 255, 1u << 23, (1u << 24) - 1, 77, 4096, 1u << 30}, out);
    EXPECT_EQ(out[4], 16777215.0f);
    EXPECT_EQ(out[7], 1073741824.0f);
}

}  // namespace
}  // namespace virga::lanes
