#include <gtest/gtest.h>

#include <numbers>

#include "matte/DrawnRain.h"
#include "matte/ExposureGain.h"

namespace virga {
namespace {

// Gains of 0.94 to 1.02 a channel, under rain that covers a quarter of the pixels: found to 0.5 %.
TEST(ExposureGain, IsFoundUnderRain)
{
    auto drawn = test::drawRain({.frames = 16, .strokes = 50, .slant = 0.1, .noise = 0.01});
    double wet = 0;
    for (const ImageF& alpha : drawn.alphas)
        for (const float a : alpha.values()) wet += a > 0.02f ? 1.0 / (16.0 * 96 * 96) : 0.0;
    EXPECT_GT(wet, 0.2);

    std::vector<double> gains(16 * 3);
    std::vector<double> mean(3);
    for (std::size_t n = 0; n < gains.size(); ++n) {
        gains[n] = 0.98 + 0.04 * std::sin(double(n) * 1.7);
        mean[n % 3] += std::log(gains[n]) / 16;
    }
    for (std::size_t k = 0; k < 16; ++k) matte::applyGain(drawn.frames[k], {&gains[3 * k], 3});
    const std::vector<double> found = matte::exposureGains(drawn.frames);
    ASSERT_EQ(found.size(), gains.size());
    for (std::size_t n = 0; n < gains.size(); ++n) EXPECT_NEAR(found[n], gains[n] / std::exp(mean[n % 3]), 0.005) << n;
}

TEST(ExposureGain, StillFootageHasNone)
{
    const auto drawn = test::drawRain({.frames = 5, .strokes = 10});
    for (const double gain : matte::exposureGains(drawn.frames)) EXPECT_NEAR(gain, 1.0, 1e-6);
    EXPECT_TRUE(matte::exposureGains({}).empty());
    for (const double gain : matte::exposureGains(std::vector<ImageF>(3, ImageF(5, 4, 3)))) EXPECT_EQ(gain, 1.0);
    for (const double gain : matte::exposureGains(std::vector<ImageF>(1, ImageF(1, 1, 1, 3.0f)))) EXPECT_EQ(gain, 1.0);
}

TEST(ExposureGain, ApplyingItBothWaysChangesNothing)
{
    auto drawn = test::drawRain({.frames = 1});
    ImageF frame = drawn.frames[0];
    const std::vector<double> gains = {0.9, 1.1, 1.3};
    matte::applyGain(frame, gains);
    matte::removeGain(frame, gains);
    for (std::size_t i = 0; i < frame.size(); ++i) EXPECT_NEAR(frame.data()[i], drawn.frames[0].data()[i], 1e-6);
}

}  // namespace
}  // namespace virga
