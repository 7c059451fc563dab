#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "matte/BoundedLines.h"

namespace virga {
namespace {

using matte::LineBlock;

/// Data that often disagree with their neighbours and with the bounds; `coupling` up to 1e9.
LineBlock randomBlock(int length, double coupling, unsigned seed)
{
    std::mt19937 engine(seed);
    const auto uniform = [&] { return double(engine() >> 8) / double(1 << 24); };
    LineBlock block(length);
    for (int i = 0; i < length; ++i)
        for (int l = 0; l < LineBlock::lanes; ++l) {
            const double seen = uniform() < 0.2 ? 0.0 : uniform();
            block.diagonal[i][l] = seen + 1e-12 + coupling * ((i > 0) + (i + 1 < length));
            block.link[i][l] = i + 1 < length ? -coupling : 0.0;
            block.rightSide[i][l] = seen * (3.0 * uniform() - 1.0) - 0.01;
            block.value[i][l] = 0.0;
        }
    return block;
}

double slope(const LineBlock& block, int i, int l)
{
    double g = block.diagonal[i][l] * block.value[i][l] - block.rightSide[i][l];
    if (i > 0) g += block.link[i - 1][l] * block.value[i - 1][l];
    if (i + 1 < block.length()) g += block.link[i][l] * block.value[i + 1][l];
    return g;
}

TEST(BoundedLines, WithoutBoundsTheGradientVanishes)
{
    for (const int length : {1, 2, 7, 300}) {
        LineBlock block = randomBlock(length, 0.25, 1);
        solveLines(block);
        for (int i = 0; i < length; ++i)
            for (int l = 0; l < LineBlock::lanes; ++l) EXPECT_NEAR(slope(block, i, l), 0.0, 1e-12);
    }
}

// Inside, the gradient vanishes; at a bound it points outwards. For a convex sum that is the minimiser.
TEST(BoundedLines, TheOptimumsConditionsHold)
{
    for (const double coupling : {0.0, 0.01, 0.25, 10.0, 1e4}) {
        for (unsigned seed = 1; seed <= 20; ++seed) {
            LineBlock block = randomBlock(200, coupling, seed);
            solveLines(block, 0.0, 1.0);
            const double rounding = 1e-11 * (1.0 + coupling);
            for (int i = 0; i < block.length(); ++i)
                for (int l = 0; l < LineBlock::lanes; ++l) {
                    const double x = block.value[i][l], g = slope(block, i, l);
                    ASSERT_GE(x, 0.0);
                    ASSERT_LE(x, 1.0);
                    ASSERT_TRUE(x == 0.0 || g <= rounding) << coupling << " " << seed << " " << i << " " << x;
                    ASSERT_TRUE(x == 1.0 || g >= -rounding) << coupling << " " << seed << " " << i << " " << x;
                }
        }
    }
}

TEST(BoundedLines, StayBoundedWhereTheyAreNearlySingular)
{
    LineBlock block = randomBlock(500, 1e9, 4);
    for (auto& row : block.rightSide) row.fill(1e4);
    solveLines(block, 0.0, 1.0);
    for (const auto& row : block.value)
        for (const double x : row) {
            EXPECT_GE(x, 0.0);
            EXPECT_LE(x, 1.0);
        }
}

}  // namespace
}  // namespace virga
