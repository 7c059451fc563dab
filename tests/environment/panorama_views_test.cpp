// Panoramas from several pictures of one world.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "World.h"
#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/DropRadiance.h"
#include "environment/Panorama.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

using test::degree;
using test::filmed;
using test::look;

void paint(ImageF& plate, int left, int top, int size, float value)
{
    for (int y = top; y < top + size; ++y) {
        for (int x = left; x < left + size; ++x) std::fill_n(plate.pixel(x, y), 3, value);
    }
}

/// Largest difference of a channel, over pixels that a predicate of the direction picks.
template <class Which>
double largestDifference(const Panorama& a, const Panorama& b, Which&& which)
{
    double largest = 0.0;
    const int width = a.pixels.width(), height = a.pixels.height();
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            if (!which(sh::panoramaDirection(x + 0.5, y + 0.5, width, height))) continue;
            for (int c = 0; c < 3; ++c)
                largest = std::max(largest, double(std::abs(a.pixels.at(x, y, c) - b.pixels.at(x, y, c))));
        }
    }
    return largest;
}

const auto everywhere = [](const glm::dvec3&) { return true; };

TEST(ViewPanorama, TheSameViewSeveralTimesIsThatView)
{
    const ImageF plate = filmed(160, 90, 60 * degree, look(0.4, 0.1));
    const PlateView view{plate, 60 * degree, look(0.4, 0.1)};
    const std::vector<PlateView> views(5, view);
    const PlatePanoramaOptions detailed{.width = 128, .detail = true};
    EXPECT_LT(
        largestDifference(panoramaFromViews(views, detailed), panoramaFromViews({&view, 1}, detailed), everywhere),
        1e-6);
    // Without detail one view is filled in a faster way; what drops return hardly tells.
    const DropRadianceBaker baker({.order = DropRadianceOptions::plateOrder, .lights = false});
    const DropRadiance one = baker.bake(panoramaFromViews({&view, 1})), many = baker.bake(panoramaFromViews(views));
    EXPECT_LT(largestDifference({one.radiance}, {many.radiance}, everywhere), 0.05);
}

TEST(ViewPanorama, ExposuresAreEvenedOut)
{
    std::vector<ImageF> plain, uneven;
    std::vector<PlateView> a, b;
    for (int i = 0; i < 6; ++i) {
        plain.push_back(filmed(160, 90, 60 * degree, look(0.25 * i, 0)));
        uneven.push_back(filmed(160, 90, 60 * degree, look(0.25 * i, 0), i % 2 ? 1.4 : 1 / 1.4));
    }
    for (int i = 0; i < 6; ++i) {
        a.push_back({plain[std::size_t(i)], 60 * degree, look(0.25 * i, 0)});
        b.push_back({uneven[std::size_t(i)], 60 * degree, look(0.25 * i, 0)});
    }
    const PlatePanoramaOptions options{.width = 256, .detail = true, .evenExposures = true};
    const Panorama truth = panoramaFromViews(a, {.width = 256, .detail = true}), made = panoramaFromViews(b, options);
    const auto seen = [](const glm::dvec3& d) { return std::abs(d.y) < 0.1 && d.x > 0 && d.z < -0.1; };
    EXPECT_LT(largestDifference(truth, made, seen), 0.01);
    EXPECT_GT(largestDifference(truth, panoramaFromViews(b, {.width = 256, .detail = true}), seen), 0.1);
}

TEST(ViewPanorama, WhoWalksThroughTheFrameIsVotedOut)
{
    const ImageF clean = filmed(160, 90, 60 * degree, look(0, 0));
    std::vector<ImageF> frames(7, clean);
    for (int i = 0; i < 7; ++i) paint(frames[std::size_t(i)], 5 + 20 * i, 30, 30, i % 2 ? 4.0f : 0.0f);
    std::vector<PlateView> views, cleanViews;
    for (const ImageF& frame : frames) {
        views.push_back({frame, 60 * degree, look(0, 0)});
        cleanViews.push_back({clean, 60 * degree, look(0, 0)});
    }
    for (const bool detail : {false, true}) {
        const PlatePanoramaOptions options{.width = 256, .detail = detail};
        const Panorama with = panoramaFromViews(views, options), without = panoramaFromViews(cleanViews, options);
        // A walker covers a pixel in at most two frames of seven; the walker alone would differ by over 3. What is left
        // is where few of a cell's pixels are hidden: near enough to be averaged.
        EXPECT_LT(largestDifference(with, without, everywhere), 0.03) << detail;
    }
}

TEST(ViewPanorama, AroundTheHorizonItIsTheWorld)
{
    constexpr int count = 9, width = 512;
    std::vector<ImageF> frames;
    std::vector<PlateView> views;
    for (int i = 0; i < count; ++i) frames.push_back(filmed(256, 192, 70 * degree, look(40 * i * degree, 0)));
    for (int i = 0; i < count; ++i) views.push_back({frames[std::size_t(i)], 70 * degree, look(40 * i * degree, 0)});
    const Panorama made = panoramaFromViews(views, {.width = width, .detail = true});
    double square = 0.0, count2 = 0.0;
    for (int y = 0; y < width / 2; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 d = sh::panoramaDirection(x + 0.5, y + 0.5, width, width / 2);
            if (std::abs(std::asin(d.y)) > 18 * degree) continue;
            // What a pixel of the panorama covers, as its edges are sharp.
            glm::dvec3 truth(0.0);
            for (int k = 0; k < 16; ++k)
                truth += test::worldRadiance(
                    sh::panoramaDirection(x + (k % 4 + 0.5) / 4, y + (k / 4 + 0.5) / 4, width, width / 2));
            const double apart = made.pixels.at(x, y, 1) - truth.g / 16;
            square += apart * apart;
            count2 += 1.0;
        }
    }
    EXPECT_LT(std::sqrt(square / count2), 0.02);  // the world's own deviation is 0.09
}

TEST(ViewPanorama, ThreadsAndOrderDoNotShow)
{
    const ImageF a = filmed(96, 54, 60 * degree, look(0, 0)), b = filmed(96, 54, 60 * degree, look(0.5, 0.1)),
                 c = filmed(96, 54, 60 * degree, look(0.8, 0));
    const PlateView views[] = {
        {a, 60 * degree, look(0, 0)}, {b, 60 * degree, look(0.5, 0.1)}, {c, 60 * degree, look(0.8, 0)}};
    const PlateView reversed[] = {views[2], views[1], views[0]};
    const PlatePanoramaOptions options{.width = 256, .detail = true};
    const Panorama whole = panoramaFromViews(views, options);
    EXPECT_LT(largestDifference(whole, panoramaFromViews(reversed, options), everywhere), 1e-6);
    const ThreadLimit one(1);
    EXPECT_EQ(largestDifference(whole, panoramaFromViews(views, options), everywhere), 0.0);
}

TEST(ViewPanorama, TransparentAndBrokenPixelsDoNotCount)
{
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const ImageF clean = filmed(96, 54, 60 * degree, look(0, 0));
    ImageF holes(96, 54, 4, 0.0f);
    for (int y = 0; y < 54; ++y) {
        for (int x = 0; x < 96; ++x) {
            if (x > 60) continue;
            std::copy_n(clean.pixel(x, y), 3, holes.pixel(x, y));
            holes.at(x, y, 3) = 1.0f;
            if (x % 7 == 3) holes.at(x, y, 1) = nan;
        }
    }
    const PlateView views[] = {{holes, 60 * degree, look(0, 0)}, {clean, 60 * degree, look(0, 0)}};
    const Panorama made = panoramaFromViews(views, {.width = 256, .detail = true});
    for (const float value : made.pixels.values()) ASSERT_TRUE(std::isfinite(value) && value >= 0.0f);
    const Panorama truth = panoramaFromViews({views + 1, 1}, {.width = 256, .detail = true});
    const glm::dvec3 rightHalf = look(20 * degree, 0) * glm::dvec3(0, 0, -1);
    EXPECT_LT(largestDifference(made, truth, [&](const glm::dvec3& d) { return glm::dot(d, rightHalf) > 0.99; }), 0.02);
}

TEST(ViewPanorama, WhatIsTransparentHasNoVote)
{
    // Two of three frames are empty but for a corner.
    const ImageF clean = filmed(160, 90, 60 * degree, look(0, 0));
    ImageF corner(160, 90, 4, 0.0f);
    for (int y = 0; y < 20; ++y) {
        for (int x = 0; x < 20; ++x) std::fill_n(corner.pixel(x, y), 4, 1.0f);
    }
    const PlateView views[] = {
        {corner, 60 * degree, look(0, 0)}, {clean, 60 * degree, look(0, 0)}, {corner, 60 * degree, look(0, 0)}};
    const Panorama alone = panoramaFromViews({views + 1, 1}, {.width = 256, .detail = true});
    const auto middle = [](const glm::dvec3& d) { return d.z < -0.97; };
    for (const bool detail : {false, true}) {
        const Panorama made = panoramaFromViews(views, {.width = 256, .detail = detail});
        // Without detail a pixel is the mean of a cell.
        EXPECT_LT(largestDifference(made, alone, middle), detail ? 0.01 : 0.2);
    }
}

TEST(ViewPanorama, RefusesNoView) { EXPECT_THROW(panoramaFromViews({}), Error); }

}  // namespace
}  // namespace virga::environment
