#include <gtest/gtest.h>

#include "matte/DrawnRain.h"
#include "matte/RainColor.h"

namespace virga {
namespace {

// The scene known: what is left is the noise's doing, within 3 of its own standard errors (4 cases: 1 in 90 by chance).
// The scene is smooth, so that pairs have little contrast and the errors are large.
TEST(RainColor, IsFoundBeforeAKnownScene)
{
    for (const double slant : {0.0, -0.3}) {
        for (const std::array<float, 3> color : {std::array{0.78f, 0.80f, 0.82f}, std::array{0.9f, 0.7f, 0.5f}}) {
            const auto drawn = test::drawRain({.frames = 20, .slant = slant, .noise = 0.008, .color = color});
            const auto found = matte::rainColor({drawn.frames}, drawn.scene, slant, 0.008);
            ASSERT_TRUE(found.found);
            double mean = 0;
            for (std::size_t j = 0; j < 3; ++j) {
                EXPECT_NEAR(found.color[j], color[j], 3.0 * found.error);
                mean += (found.color[j] - color[j]) / 3.0;
            }
            EXPECT_LT(std::abs(mean), 3 * found.error);
            EXPECT_LT(found.error, 0.06);
        }
    }
}

TEST(RainColor, SaysWhenItCannotTell)
{
    const auto dry = test::drawRain({.strokes = 0, .noise = 0.008});
    EXPECT_FALSE(matte::rainColor({dry.frames}, dry.scene, 0.0, 0.008).found);
    const std::vector<ImageF> flat(3, ImageF(20, 20, 1, 0.5f));
    EXPECT_FALSE(matte::rainColor({flat}, ImageF(20, 20, 1, 0.3f), 0.0, 0.001).found);
    const std::vector<ImageF> dot(1, ImageF(1, 1, 3, 0.5f));
    EXPECT_FALSE(matte::rainColor({dot}, ImageF(1, 1, 3), 0.0, 0.0).found);
}

}  // namespace
}  // namespace virga
