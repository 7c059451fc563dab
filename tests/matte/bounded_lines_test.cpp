#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <type_traits>

#include "matte/BoundedLines.h"

namespace virga {
namespace {

using matte::LineBlock;

template <class Real>
class BoundedLines : public ::testing::Test {
};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BoundedLines, Reals);

/// Data that often disagree with their neighbours and with the bounds; `coupling` up to 1e9.
template <class Real>
LineBlock<Real> randomBlock(int length, double coupling, unsigned seed)
{
    std::mt19937 engine(seed);
    const auto uniform = [&] { return double(engine() >> 8) / double(1 << 24); };
    LineBlock<Real> block(length);
    block.coupling.fill(Real(coupling));
    for (int i = 0; i < length; ++i)
        for (int l = 0; l < block.lanes; ++l) {
            const double seen = uniform() < 0.2 ? 0.0 : uniform();
            block.own[i][l] = Real(seen + 1e-12);
            block.pull[i][l] = Real(seen * (3.0 * uniform() - 1.0) - 0.01);
            block.value[i][l] = 0;
        }
    return block;
}

template <class Real>
double slope(const LineBlock<Real>& block, int i, int l)
{
    const double x = block.value[i][l], coupling = block.coupling[l];
    double g = block.own[i][l] * x - block.pull[i][l];
    if (i > 0) g += coupling * (x - block.value[i - 1][l]);
    if (i + 1 < block.length()) g += coupling * (x - block.value[i + 1][l]);
    return g;
}

TYPED_TEST(BoundedLines, WithoutBoundsTheGradientVanishes)
{
    const double rounding = std::is_same_v<TypeParam, float> ? 1e-5 : 1e-13;
    for (const int length : {1, 2, 7, 300}) {
        auto block = randomBlock<TypeParam>(length, 0.25, 1);
        solveLines(block);
        for (int i = 0; i < length; ++i)
            for (int l = 0; l < block.lanes; ++l) EXPECT_NEAR(slope(block, i, l), 0.0, rounding);
    }
}

// Inside, the gradient vanishes; at a bound it points outwards. For a convex sum that is the minimiser. In float with a
// slack, without which rounding alone could change the sets for ever.
TYPED_TEST(BoundedLines, TheOptimumsConditionsHold)
{
    const bool isFloat = std::is_same_v<TypeParam, float>;
    const double slack = isFloat ? 1e-5 : 0.0;
    for (const double coupling : {0.0, 0.01, 0.25, 10.0, 1e4}) {
        for (unsigned seed = 1; seed <= 20; ++seed) {
            auto block = randomBlock<TypeParam>(200, coupling, seed);
            solveLines(block, TypeParam(0), TypeParam(1), TypeParam(slack));
            const double rounding = (isFloat ? 1e-6 + 2 * slack : 1e-12) * (1.0 + coupling);
            for (int i = 0; i < block.length(); ++i)
                for (int l = 0; l < block.lanes; ++l) {
                    const double x = block.value[i][l], g = slope(block, i, l);
                    ASSERT_GE(x, 0.0);
                    ASSERT_LE(x, 1.0);
                    ASSERT_TRUE(x == 0.0 || g <= rounding) << coupling << " " << seed << " " << i << " " << x;
                    ASSERT_TRUE(x == 1.0 || g >= -rounding) << coupling << " " << seed << " " << i << " " << x;
                }
        }
    }
}

// What single pixels say of a line is not lost in float, though they are held together 1e9 times as strongly: a line
// that moves as one has the mean of them.
TYPED_TEST(BoundedLines, StrongCouplingGivesTheMean)
{
    auto block = randomBlock<TypeParam>(500, 1e9, 4);
    std::array<double, 64> own{}, pull{};
    for (int i = 0; i < 500; ++i)
        for (int l = 0; l < block.lanes; ++l) {
            own[std::size_t(l)] += block.own[i][l];
            pull[std::size_t(l)] += block.pull[i][l];
        }
    solveLines(block);
    for (int i = 0; i < 500; ++i)
        for (int l = 0; l < block.lanes; ++l)
            ASSERT_NEAR(block.value[i][l], pull[std::size_t(l)] / own[std::size_t(l)], 1e-4);
}

TYPED_TEST(BoundedLines, StayBoundedWhereTheyAreNearlySingular)
{
    auto block = randomBlock<TypeParam>(500, 1e9, 4);
    for (auto& row : block.pull) row.fill(TypeParam(1e4));
    solveLines(block, TypeParam(0), TypeParam(1));
    for (const auto& row : block.value)
        for (const double x : row) {
            EXPECT_GE(x, 0.0);
            EXPECT_LE(x, 1.0);
        }
}

}  // namespace
}  // namespace virga
