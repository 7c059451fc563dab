#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "matte/DrawnRain.h"
#include "matte/Pictures.h"
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

// Whatever it lies over, and which way: 12 cases within 3 of their errors, 1 in 30 by chance. A texture has contrast,
// so that the errors are small.
TEST(RainColor, IsFoundOverTextureWhicheverWayItFalls)
{
    for (const double degrees : {0.0, 10.0, 40.0, 75.0})
        for (const double noise : {1.0 / 255, 2.0 / 255, 3.0 / 255}) {
            const double slant = degrees * std::numbers::pi / 180;
            const auto drawn = test::drawRain({.frames = 16, .slant = slant, .noise = noise, .texture = 0.08});
            const auto found = matte::rainColor({drawn.frames}, drawn.scene, slant, noise);
            ASSERT_TRUE(found.found);
            EXPECT_NEAR((found.color[0] + found.color[1] + found.color[2]) / 3, 0.8, 3 * found.error)
                << degrees << ' ' << noise;
            EXPECT_LT(found.error, 0.05) << degrees << ' ' << noise;
        }
}

// In the units of the footage, whatever the guess; a grey picture has one channel's.
TEST(RainColor, GrowsWithTheFootage)
{
    const auto drawn = test::drawRain({.frames = 12, .noise = 0.008, .texture = 0.08});
    const auto one = matte::rainColor({drawn.frames}, drawn.scene, 0.0, 0.008);
    ASSERT_TRUE(one.found);
    for (const float factor : {1e-3f, 1e4f}) {
        std::vector<ImageF> frames;
        for (const ImageF& frame : drawn.frames) frames.push_back(test::scaled(frame, factor));
        const auto many = matte::rainColor({frames}, test::scaled(drawn.scene, factor), 0.0, 0.008 * factor, factor);
        for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(many.color[j] / factor, one.color[j], 1e-3);
        EXPECT_NEAR(many.error / factor, one.error, 1e-3);
    }
    const auto other = matte::rainColor({drawn.frames}, drawn.scene, 0.0, 0.008, 0.6);
    EXPECT_NEAR(other.color[1], one.color[1], one.error);

    ImageF scene(96, 96, 1);
    std::vector<ImageF> frames(12, scene);
    for (std::size_t i = 0; i < scene.size(); ++i) {
        scene.data()[i] = drawn.scene.data()[3 * i];
        for (std::size_t k = 0; k < 12; ++k) frames[k].data()[i] = drawn.frames[k].data()[3 * i];
    }
    const auto grey = matte::rainColor({frames}, scene, 0.0, 0.008);
    ASSERT_TRUE(grey.found);
    EXPECT_NEAR(grey.color[0], 0.78, 3 * grey.error);
    EXPECT_EQ(grey.color[1], grey.color[0]);
    EXPECT_EQ(grey.color[2], grey.color[0]);
}

// What is not trusted is not asked: here it would say a C of 3.
TEST(RainColor, AsksWhatIsTrusted)
{
    auto drawn = test::drawRain({.frames = 16, .noise = 0.008, .texture = 0.08});
    std::vector<ImageF> trust(16, ImageF(96, 96, 1, 1.0f));
    for (std::size_t k = 0; k < 16; ++k)
        for (int y = 0; y < 96; ++y)
            for (int x = 0; x < 40; ++x) {
                trust[k].at(x, y) = 0;
                for (int j = 0; j < 3; ++j) drawn.frames[k].at(x, y, j) += drawn.alphas[k].at(x, y) * 2.2f;
            }
    const auto found = matte::rainColor({drawn.frames, trust}, drawn.scene, 0.0, 0.008);
    ASSERT_TRUE(found.found);
    EXPECT_NEAR((found.color[0] + found.color[1] + found.color[2]) / 3, 0.8, 3 * found.error);
    EXPECT_LT(found.error, 0.05);
}

double offFrom(const matte::RainColor& found, double mean)
{
    return (found.color[0] + found.color[1] + found.color[2]) / 3 - mean;
}

// What is behind the strokes shows through them with its hue, and the less of it the brighter they are: a few short
// strokes tell, whatever their alphas do. Without hue in the scene nothing does, and the error says so.
TEST(RainColor, FollowsFromTheHueBehindFewStrokes)
{
    for (unsigned seed = 1; seed <= 6; ++seed)
        for (const double noise : {0.0, 1.0 / 255}) {
            const auto drawn = test::drawRain({.frames = 6, .strokes = 6, .slant = 0.2, .noise = noise, .seed = seed});
            const double sigma = std::max(noise, 0.001);
            const auto found = matte::rainColor({drawn.frames}, drawn.scene, 0.2, sigma);
            ASSERT_TRUE(found.found);
            EXPECT_LT(std::abs(offFrom(found, 0.8)), noise > 0 ? 0.04 : 0.002) << seed << ' ' << noise;
            EXPECT_LT(found.error, noise > 0 ? 0.03 : 0.001) << seed << ' ' << noise;

            std::vector<ImageF> grey = drawn.frames;
            ImageF scene = drawn.scene;
            const auto toGrey = [](ImageF& image) {
                for (std::size_t i = 0; i < image.size(); i += 3)
                    image.data()[i] = image.data()[i + 2] = image.data()[i + 1];
            };
            for (ImageF& frame : grey) toGrey(frame);
            toGrey(scene);
            const auto less = matte::rainColor({grey}, scene, 0.2, sigma);
            EXPECT_TRUE(!less.found || less.error > 2 * found.error) << seed << ' ' << noise;
        }
}

// Colours without their fine detail, as codecs leave them: in narrow strokes too weak, which looks like more light than
// there is. The hue is not asked then: what is found is what the light alone says.
TEST(RainColor, DoesNotAskHuesThatAreSmoothed)
{
    constexpr int block = 4;
    for (unsigned seed = 1; seed <= 3; ++seed) {
        const auto drawn = test::drawRain({.frames = 16, .noise = 0.004, .seed = seed});
        std::vector<ImageF> frames = drawn.frames;
        for (ImageF& frame : frames)
            for (int y = 0; y < 96; y += block)
                for (int x = 0; x < 96; x += block) {
                    const auto light = [&](int n) {
                        const float* p = frame.pixel(x + n % block, y + n / block);
                        return (p[0] + p[1] + p[2]) / 3;
                    };
                    std::array<float, 3> tint{};
                    for (std::size_t j = 0; j < 3; ++j)
                        for (int n = 0; n < block * block; ++n)
                            tint[j] += (frame.at(x + n % block, y + n / block, int(j)) - light(n)) / (block * block);
                    for (int n = 0; n < block * block; ++n) {
                        const float own = light(n);
                        for (std::size_t j = 0; j < 3; ++j)
                            frame.at(x + n % block, y + n / block, int(j)) = own + tint[j];
                    }
                }
        const auto found = matte::rainColor({frames}, drawn.scene, 0.0, 0.004);
        ASSERT_TRUE(found.found);
        EXPECT_LT(std::abs(offFrom(found, 0.8)), 0.06) << seed;  // the hue says 1.2
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
