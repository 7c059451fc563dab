#include <gtest/gtest.h>

#include <numbers>

#include "matte/DrawnRain.h"
#include "matte/RainDirection.h"

namespace virga {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

// 20 drawings: the header's 0.06 degrees with room for another generator's strokes.
TEST(RainDirection, IsFoundToATenthOfADegree)
{
    double square = 0, worst = 0;
    int count = 0;
    for (const double slant : {0.0, 3.0, 7.0, 12.0, -20.0, 35.0, 45.0, -60.0, 80.0, 90.0}) {
        for (const double noise : {0.0, 0.02}) {
            auto drawn = test::drawRain({.slant = slant * degree, .seed = 3});
            if (noise > 0.0) {
                const auto empty = test::drawRain({.strokes = 0, .noise = noise, .seed = 5});
                for (std::size_t k = 0; k < drawn.alphas.size(); ++k)
                    for (std::size_t i = 0; i < drawn.alphas[k].size(); ++i)
                        drawn.alphas[k].data()[i] += empty.frames[k].data()[3 * i] - empty.scene.data()[3 * i];
            }
            const auto found = matte::rainDirection(drawn.alphas);
            const double off = std::remainder(found.slant / degree - slant, 180.0);
            square += off * off;
            worst = std::max(worst, std::abs(off));
            EXPECT_GT(found.coherence, noise > 0.0 ? 0.3 : 0.7) << slant;
            ++count;
        }
    }
    EXPECT_LT(std::sqrt(square / count), 0.1);
    EXPECT_LT(worst, 0.25);
    RecordProperty("rms_degrees", std::to_string(std::sqrt(square / count)));
}

// Large drops fall faster, at another slant, and are denser. Each stroke counts for its alpha, not for its square: four
// strokes at 10 degrees and one, four times as dense, at 4 have the direction of 7.
TEST(RainDirection, DenseStrokesCountForTheirAlpha)
{
    std::vector<ImageF> alphas;
    for (unsigned seed = 1; seed <= 4; ++seed) {
        auto faint = test::drawRain(
            {.width = 160, .height = 160, .frames = 10, .strokes = 32, .slant = 10 * degree, .seed = seed});
        const auto dense = test::drawRain(
            {.width = 160, .height = 160, .frames = 10, .strokes = 8, .slant = 4 * degree, .seed = seed + 10});
        for (std::size_t k = 0; k < faint.alphas.size(); ++k) {
            for (std::size_t i = 0; i < faint.alphas[k].size(); ++i)
                faint.alphas[k].data()[i] = 0.25f * faint.alphas[k].data()[i] + dense.alphas[k].data()[i];
            alphas.push_back(std::move(faint.alphas[k]));
        }
    }
    EXPECT_NEAR(matte::rainDirection(alphas).slant / degree, 7.0, 0.7);
}

TEST(RainDirection, NothingAndNoiseHaveNone)
{
    EXPECT_EQ(matte::rainDirection({}).coherence, 0.0);
    const std::vector<ImageF> flat(3, ImageF(20, 20, 1, 0.4f)), dot(1, ImageF(2, 2, 1, 0.4f));
    EXPECT_EQ(matte::rainDirection(flat).coherence, 0.0);
    EXPECT_EQ(matte::rainDirection(flat).slant, 0.0);
    EXPECT_EQ(matte::rainDirection(dot).coherence, 0.0);

    const auto noise = test::drawRain({.strokes = 0, .noise = 0.02});
    std::vector<ImageF> alphas;
    for (const ImageF& frame : noise.frames) {
        alphas.emplace_back(96, 96, 1);
        for (std::size_t i = 0; i < alphas.back().size(); ++i)
            alphas.back().data()[i] = frame.data()[3 * i] - noise.scene.data()[3 * i];
    }
    EXPECT_LT(matte::rainDirection(alphas).coherence, 0.03);
}

}  // namespace
}  // namespace virga
