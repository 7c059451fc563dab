#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "core/Error.h"
#include "matte/RainEstimate.h"
#include "rainfall/DropSizes.h"
#include "rainfall/TerminalSpeed.h"
#include "support/Files.h"

namespace virga {
namespace {

constexpr double pi = std::numbers::pi;

struct Rain {
    double rate = 25;         // [mm/h]
    double exposure = 0.005;  // [s]
    double opacity = 5;
    double slant = 0;          // [rad]
    double aperture = 2.7e-3;  // [m], focus at 5 m
    int width = 960, height = 540, frames = 6;
    double least = 0.02;  // contrast that the finder wants
    double pixels = 1;    // of this picture in one of the finder's: limits and blur in px go with it
    double scatter = 0;   // standard deviation of the logarithms of what is measured
    unsigned seed = 1;
};

/// Strokes by the model of RainEstimate.h: drops anywhere in the view, of Marshall and Palmer's sizes, as a finder that
/// wants strokes of 6 px reports them.
std::vector<matte::RainStroke> strokesOf(const Rain& rain)
{
    std::mt19937 engine(rain.seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal(0, 1);
    const auto scattered = [&] { return rain.scatter > 0 ? std::exp(rain.scatter * normal(engine)) : 1.0; };
    const rainfall::DropSizes sizes(rain.rate);
    const double focal = 0.5 * rain.width / std::tan(pi / 6), blur = 1.3 * rain.pixels;
    constexpr double near = 0.8, smallest = 4e-4;
    std::vector<matte::RainStroke> strokes;
    // Slices of diameter, so that the many small drops are sought only as far as they can be seen.
    for (double d0 = smallest; d0 < rainfall::DropSizes::breakUpDiameter; d0 *= 1.1) {
        const double drift = 1 / std::cos(rain.slant);
        const double fast = rainfall::terminalSpeed(1.1 * d0) * drift * rain.exposure;
        const double far = std::min({200.0, fast * focal / (6 * rain.pixels),
                                     rain.opacity * 1.21 * d0 * d0 * focal / (rain.least * fast / 1.1 * 0.9 * blur)});
        if (far <= near) continue;
        // Strokes whose middle lies outside are seen too: the view is one and a half times as wide as the picture.
        const double sides = 2.25 * rain.width * rain.height / (focal * focal);
        const double volume = sides * (far * far * far - near * near * near) / 3;
        std::poisson_distribution<int> drops(sizes.numberPerVolume(d0, 1.1 * d0) * volume * rain.frames);
        for (int n = drops(engine); n > 0; --n) {
            const double d = sizes.sampleDiameter(uniform(engine), d0, 1.1 * d0);
            const double z = std::cbrt(near * near * near + uniform(engine) * (far * far * far - near * near * near));
            matte::RainStroke s;
            s.frame = int(uniform(engine) * rain.frames);
            s.x = (1.5 * uniform(engine) - 0.25) * rain.width;
            s.y = (1.5 * uniform(engine) - 0.25) * rain.height;
            s.slant = rain.slant + 0.03 * normal(engine);
            const double drop = d * focal / z;
            const double confusion = focal * rain.aperture * std::abs(1 / z - 1 / 5.0);
            s.length = rainfall::terminalSpeed(d) * drift * rain.exposure * focal / z;
            s.width = std::sqrt(0.75 * 0.75 * (drop * drop + confusion * confusion) + blur * blur);
            // 1.08: RainStroke's mean is over the middle half of the width.
            s.mean = rain.opacity * pi / 4 * drop * drop / s.length / s.width / 1.08;
            s.mean *= scattered(), s.length *= std::sqrt(scattered()), s.width *= std::sqrt(scattered());
            if (s.mean < rain.least || s.mean > 1 || s.length < 6 * rain.pixels || s.width > 10 * rain.pixels ||
                s.length < 2 * s.width)
                continue;
            s.contrast = s.mean, s.peak = 1.2 * s.mean;
            const double reachX = 0.5 * (s.length * std::abs(std::sin(s.slant)) + s.width);
            const double reachY = 0.5 * s.length * std::cos(s.slant);
            if (s.x + reachX < 0 || s.x - reachX > rain.width || s.y + reachY < 0 || s.y - reachY > rain.height)
                continue;
            s.inside = s.x > reachX && s.x < rain.width - reachX && s.y > reachY && s.y < rain.height - reachY;
            // As RainStrokes.h has it, its shape's part left to chance.
            if (s.inside)
                s.score = (0.6 + 0.4 * uniform(engine)) * std::sqrt(std::min(1.0, 1.2 * rain.pixels / s.width)) *
                          std::min(1.0, s.length / (4 * s.width)) * s.contrast / (s.contrast + 0.8 * rain.least);
            strokes.push_back(s);
        }
    }
    return strokes;
}

matte::RainEstimate estimateOf(const Rain& rain, const std::vector<matte::RainStroke>& strokes)
{
    matte::RainEstimateOptions options;
    options.minContrast = rain.least;
    options.minLength = 6 * rain.pixels, options.maxWidth = 10 * rain.pixels, options.blur_px = 1.3 * rain.pixels;
    options.aperture_m = rain.aperture;
    return matte::estimateRain(strokes, rain.width, rain.height, rain.frames, options);
}
matte::RainEstimate estimateOf(const Rain& rain) { return estimateOf(rain, strokesOf(rain)); }

double off(double a, double b) { return std::abs(std::log(a / b)); }

void expectFinite(const matte::RainEstimate& e)
{
    for (const double value : {e.rate_mm_h, e.rateLow, e.rateHigh, e.exposure_s, e.exposureLow, e.exposureHigh,
                               e.opacity, e.opacityLow, e.opacityHigh, e.diameter_m, e.density})
        EXPECT_TRUE(std::isfinite(value) && value >= 0) << value;
    EXPECT_TRUE(std::isfinite(e.wind_m_s));
    EXPECT_LE(e.rateLow, e.rate_mm_h);
    EXPECT_LE(e.rate_mm_h, e.rateHigh);
    EXPECT_LE(e.exposureLow, e.exposure_s);
    EXPECT_LE(e.exposure_s, e.exposureHigh);
    EXPECT_LE(e.opacityLow, e.opacity);
    EXPECT_LE(e.opacity, e.opacityHigh);
    if (e.found) {
        EXPECT_GT(e.rateLow, 0);
        EXPECT_GT(e.exposureLow, 0);
    }
}

// Measured: rates are off by a factor of 1.42 at most, exposures by 10 %, opacities by 21 %.
TEST(RainEstimate, GivesBackTheRainThatStrokesAreDrawnFrom)
{
    for (const double rate : {5.0, 25.0, 80.0})
        for (const double exposure : {1 / 500.0, 1 / 200.0, 1 / 60.0})
            for (const double scatter : {0.0, 0.2}) {
                SCOPED_TRACE(testing::Message() << rate << " mm/h, 1/" << 1 / exposure << " s, scatter " << scatter);
                const auto e = estimateOf({.rate = rate, .exposure = exposure, .scatter = scatter});
                ASSERT_TRUE(e.found);
                expectFinite(e);
                EXPECT_LT(off(e.rate_mm_h, rate), std::log(1.5)) << e.rate_mm_h;
                EXPECT_LT(off(e.exposure_s, exposure), std::log(1.15)) << e.exposure_s;
                EXPECT_TRUE(e.opacityMeasured);
                EXPECT_LT(off(e.opacity, 5), std::log(1.3)) << e.opacity;
                EXPECT_LT(e.rateLow, rate);
                EXPECT_GT(e.rateHigh, rate);
                EXPECT_LT(e.exposureLow, exposure);
                EXPECT_GT(e.exposureHigh, exposure);
            }
}

TEST(RainEstimate, TwiceTheStrokesAreMoreRain)
{
    const Rain rain;
    auto strokes = strokesOf(rain);
    const auto once = estimateOf(rain, strokes);
    const auto more = strokesOf({.seed = 2});
    strokes.insert(strokes.end(), more.begin(), more.end());
    const auto twice = estimateOf(rain, strokes);
    EXPECT_NEAR(twice.density / once.density, 2, 0.1);
    EXPECT_GT(twice.rate_mm_h, 1.5 * once.rate_mm_h);
    EXPECT_NEAR(twice.exposure_s / once.exposure_s, 1, 0.15);
}

TEST(RainEstimate, MoreRainIsMoreRain)
{
    double before = 0;
    for (const double rate : {2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0}) {
        const double found = estimateOf({.rate = rate}).rate_mm_h;
        EXPECT_GT(found, 1.2 * before) << rate;
        before = found;
    }
}

TEST(RainEstimate, TwiceTheExposureIsFoundTwice)
{
    for (const double exposure : {1 / 400.0, 1 / 200.0, 1 / 100.0}) {
        const auto once = estimateOf({.exposure = exposure}), twice = estimateOf({.exposure = 2 * exposure});
        EXPECT_NEAR(twice.exposure_s / once.exposure_s, 2, 0.25) << exposure;
    }
}

TEST(RainEstimate, OpacityIsTakenFromWideStrokes)
{
    const auto faint = estimateOf({.opacity = 3}), strong = estimateOf({.opacity = 6});
    // What is usual pulls at both.
    EXPECT_GT(strong.opacity / faint.opacity, 1.5);
    EXPECT_LT(faint.opacityLow, 3);
    EXPECT_GT(faint.opacityHigh, 3);
    EXPECT_LT(strong.opacityLow, 6);
    EXPECT_GT(strong.opacityHigh, 6);
    EXPECT_NEAR(strong.exposure_s / faint.exposure_s, 1, 0.15);
    // A lens so long and a picture so coarse that nothing is wider than the blur.
    const Rain coarse{.exposure = 1 / 60.0, .width = 160, .height = 90, .frames = 200, .least = 0.005};
    const auto e = estimateOf(coarse);
    ASSERT_TRUE(e.found);
    EXPECT_FALSE(e.opacityMeasured);
    EXPECT_EQ(e.opacity, 5);
    EXPECT_GT(e.opacityHigh / e.opacityLow, strong.opacityHigh / strong.opacityLow);
}

TEST(RainEstimate, ALargerPictureOfTheSameStrokesChangesNothing)
{
    const auto small = estimateOf({}), large = estimateOf({.width = 1920, .height = 1080, .pixels = 2});
    EXPECT_EQ(small.counted, large.counted);
    EXPECT_NEAR(large.rate_mm_h / small.rate_mm_h, 1, 1e-6);
    EXPECT_NEAR(large.exposure_s / small.exposure_s, 1, 1e-6);
    EXPECT_NEAR(large.opacity / small.opacity, 1, 1e-6);
    // With finer pixels more is seen of the same rain.
    const auto fine = estimateOf({.width = 1920, .height = 1080, .frames = 2});
    EXPECT_LT(off(fine.rate_mm_h, 25), std::log(1.5));
    EXPECT_LT(off(fine.exposure_s, 0.005), std::log(1.15));
}

TEST(RainEstimate, AWrongFieldOfViewLeavesTheExposure)
{
    const Rain sharp{.aperture = 0};
    const auto strokes = strokesOf(sharp);
    matte::RainEstimateOptions options;
    options.minContrast = sharp.least, options.aperture_m = 0;
    options.near_m = 0.1;
    options.focal_px = 0.5 * 960 / std::tan(pi / 6);
    const auto right = matte::estimateRain(strokes, 960, 540, sharp.frames, options);
    options.focal_px *= 2;
    const auto tele = matte::estimateRain(strokes, 960, 540, sharp.frames, options);
    EXPECT_NEAR(tele.exposure_s / right.exposure_s, 1, 0.05);
    EXPECT_GT(right.rate_mm_h / tele.rate_mm_h, 1.6);
    EXPECT_LT(right.rate_mm_h / tele.rate_mm_h, 3);
}

TEST(RainEstimate, WhatNoiseHidesIsNotMissed)
{
    auto strokes = strokesOf({});
    std::erase_if(strokes, [](const matte::RainStroke& s) { return s.contrast < 0.05; });
    const auto e = estimateOf({}, strokes);
    EXPECT_LT(off(e.rate_mm_h, 25), std::log(1.6));
    EXPECT_LT(off(e.exposure_s, 0.005), std::log(1.15));
}

TEST(RainEstimate, WindIsTheSlant)
{
    const auto still = estimateOf({}), right = estimateOf({.slant = 0.3}), left = estimateOf({.slant = -0.3});
    EXPECT_NEAR(still.wind_m_s, 0, 0.05);
    EXPECT_NEAR(right.wind_m_s, rainfall::terminalSpeed(right.diameter_m) * std::tan(0.3), 0.05);
    EXPECT_NEAR(left.wind_m_s, -rainfall::terminalSpeed(left.diameter_m) * std::tan(0.3), 0.05);
    // Drops that drift go a longer way than they fall.
    EXPECT_LT(off(right.rate_mm_h, still.rate_mm_h), std::log(1.4));
    EXPECT_LT(off(right.exposure_s, 0.005), std::log(1.15));
    EXPECT_LT(off(estimateOf({.slant = 0.8}).exposure_s, 0.005), std::log(1.15));
    // Which end of a horizontal stroke is the lower is chance.
    EXPECT_LT(std::abs(estimateOf({.slant = pi / 2 - 0.01}).wind_m_s), 40);
}

TEST(RainEstimate, NoExposureIsLongerThanAFrame)
{
    const auto strokes = strokesOf({.exposure = 1 / 60.0});
    matte::RainEstimateOptions options;
    options.minContrast = 0.02;
    options.fps = 120;
    const auto e = matte::estimateRain(strokes, 960, 540, 6, options);
    EXPECT_EQ(e.exposure_s, 1 / 120.0);
    EXPECT_EQ(e.exposureHigh, 1 / 120.0);
    expectFinite(e);
}

TEST(RainEstimate, OrderMeansNothing)
{
    auto strokes = strokesOf({});
    const auto e = estimateOf({}, strokes);
    std::shuffle(strokes.begin(), strokes.end(), std::mt19937(3));
    const auto shuffled = estimateOf({}, strokes);
    EXPECT_NEAR(shuffled.rate_mm_h, e.rate_mm_h, 1e-6 * e.rate_mm_h);
    EXPECT_NEAR(shuffled.exposure_s, e.exposure_s, 1e-9 * e.exposure_s);
}

TEST(RainEstimate, FewerStrokesAreLessSure)
{
    const Rain few{.rate = 5, .frames = 1, .least = 0.08};
    const auto one = estimateOf(few), many = estimateOf({.rate = 5, .frames = 20, .least = 0.08});
    ASSERT_TRUE(one.found);
    EXPECT_GT(one.rateHigh / one.rateLow, many.rateHigh / many.rateLow);
    EXPECT_GT(one.exposureHigh / one.exposureLow, many.exposureHigh / many.exposureLow);
}

TEST(RainEstimate, WhatIsNoRainIsNotFound)
{
    const auto estimate = [](const std::vector<matte::RainStroke>& strokes) {
        const auto e = matte::estimateRain(strokes, 960, 540, 6, {});
        expectFinite(e);
        return e;
    };
    const matte::RainStroke usual{.x = 300,
                                  .y = 200,
                                  .length = 20,
                                  .width = 1.5,
                                  .peak = 0.1,
                                  .mean = 0.08,
                                  .contrast = 0.08,
                                  .inside = true,
                                  .score = 0.5};
    // Contrasts differ, as a limit is taken from them.
    const auto alike = [&](std::size_t count) {
        std::vector<matte::RainStroke> strokes(count, usual);
        for (std::size_t i = 0; i < count; ++i)
            strokes[i].mean = strokes[i].contrast = 0.06 + 0.06 * double(i) / double(count);
        return strokes;
    };
    EXPECT_FALSE(estimate({}).found);
    EXPECT_EQ(estimate({}).rate_mm_h, 0);
    EXPECT_FALSE(estimate(alike(1)).found);
    EXPECT_FALSE(estimate(alike(8)).found);
    EXPECT_TRUE(estimate(alike(50)).found);
    EXPECT_FALSE(estimate(alike(1000000)).found) << "no rain has so many";
    estimate(std::vector(100, usual));

    // Snow: broad, slow, nearly opaque.
    auto snow = alike(300);
    for (std::size_t i = 0; i < snow.size(); ++i) {
        snow[i].width = 3 + 0.02 * double(i), snow[i].length = 2.6 * snow[i].width;
        snow[i].mean *= 6, snow[i].contrast *= 6;
    }
    EXPECT_FALSE(estimate(snow).found);

    const auto good = strokesOf({.frames = 1});
    const auto without = estimate(good);
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
    for (const double value : {nan, infinite, -infinite, 0.0, -1.0, 1e-300, 1e300})
        for (double matte::RainStroke::*member :
             {&matte::RainStroke::length, &matte::RainStroke::width, &matte::RainStroke::mean,
              &matte::RainStroke::contrast, &matte::RainStroke::slant, &matte::RainStroke::score}) {
            auto spoilt = alike(50);
            for (auto& stroke : spoilt) stroke.*member = value;
            estimate(spoilt);
            // Among good ones a bad one does not count.
            auto strokes = good;
            strokes.insert(strokes.begin(), spoilt.begin(), spoilt.begin() + 1);
            EXPECT_NEAR(estimate(strokes).rate_mm_h / without.rate_mm_h, 1, 0.05) << value;
        }
    auto cut = alike(50);
    for (auto& stroke : cut) stroke.inside = false;
    EXPECT_FALSE(estimate(cut).found);
    expectFinite(matte::estimateRain(alike(50), 1, 1, 1, {}));
    expectFinite(matte::estimateRain(alike(50), 100000, 1, 1, {}));
}

TEST(RainEstimate, OptionsOutOfRangeAreNamed)
{
    using Options = matte::RainEstimateOptions;
    const auto said = [](double Options::*member, double value) {
        Options options;
        options.*member = value;
        return test::sentenceOf(ErrorCode::InvalidArgument, [&] { matte::estimateRain({}, 960, 540, 6, options); });
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_SAYS(said(&Options::focal_px, -1), "focal length");
    EXPECT_SAYS(said(&Options::near_m, 0), "least depth");
    EXPECT_SAYS(said(&Options::far_m, 0.5), "over the least, 0.8 m");
    EXPECT_SAYS(said(&Options::aperture_m, -1), "aperture");
    EXPECT_SAYS(said(&Options::focus_m, 0), "focus");
    EXPECT_SAYS(said(&Options::fps, nan), "frame rate");
    EXPECT_SAYS(said(&Options::minContrast, 0), "contrast");
    EXPECT_SAYS(said(&Options::minLength, nan), "length");
    EXPECT_SAYS(said(&Options::maxWidth, 0), "width");
    EXPECT_SAYS(said(&Options::blur_px, 0), "blur");
    test::sentenceOf(ErrorCode::Internal, [] { matte::estimateRain({}, 0, 540, 6, {}); });
    test::sentenceOf(ErrorCode::Internal, [] { matte::estimateRain({}, 960, 540, 0, {}); });
}

}  // namespace
}  // namespace virga
