// Footage of a camera that moves over a scene whose every point is known: blotches, boards with edges and grain, drawn
// at twice the resolution, so that a frame is that scene at the points where the truth says.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "core/Error.h"
#include "core/Parallel.h"
#include "matte/FrameAlignment.h"
#include "matte/TemporalMedian.h"

namespace virga {
namespace {

using matte::alignFrames;
using matte::FrameAlignment;
using matte::Homography;

class Uniform {
public:
    explicit Uniform(unsigned seed) : engine_(seed) {}
    double operator()(double low, double high)
    {
        return low + (high - low) * (double(engine_() >> 8) / double(1 << 24));
    }
    double normal()
    {
        return std::sqrt(-2 * std::log(1 - (*this)(0, 1))) * std::cos(6.283185307179586 * (*this)(0, 1));
    }

private:
    std::mt19937 engine_;
};

/// A wall without end in which nothing is the same twice, as far as a test looks.
class Scene {
public:
    static constexpr int marginX = 400, marginY = 60;  // round the reference [px]

    Scene(int width, int height, unsigned seed = 3) : points_((width + 2 * marginX) * 2, (height + 2 * marginY) * 2, 1)
    {
        Uniform uniform(seed);
        ImageF grain(points_.width(), points_.height(), 1);
        for (float& value : grain.values()) value = float(uniform(-1, 1));
        for (float& value : points_.values()) value = 0.45f;
        for (int n = 0; n < int(points_.size() / 4000); ++n) {  // boards
            const int left = int(uniform(-50, points_.width())), top = int(uniform(-50, points_.height()));
            const int right = left + int(uniform(10, 120)), bottom = top + int(uniform(10, 120));
            const float by = float(uniform(-0.25, 0.25));
            for (int y = std::max(0, top); y < std::min(points_.height(), bottom); ++y)
                for (int x = std::max(0, left); x < std::min(points_.width(), right); ++x)
                    points_.at(x, y) = std::clamp(points_.at(x, y) + by, 0.1f, 0.8f);
        }
        blur(grain);
        for (std::size_t i = 0; i < points_.size(); ++i) points_.data()[i] += 0.15f * grain.data()[i];
        for (int n = 0; n < 3; ++n) blur(points_);
    }

    /// In pixels of the reference, centres at + 1/2. Catmull-Rom.
    double operator()(double x, double y) const
    {
        const double px = 2 * (x + marginX) - 0.5, py = 2 * (y + marginY) - 0.5;
        const int x0 = std::clamp(int(std::floor(px)), 1, points_.width() - 3);
        const int y0 = std::clamp(int(std::floor(py)), 1, points_.height() - 3);
        const auto weights = [](double t) {
            return std::array<double, 4>{((2 - t) * t - 1) * t / 2, ((3 * t - 5) * t * t + 2) / 2,
                                         ((4 - 3 * t) * t + 1) * t / 2, (t - 1) * t * t / 2};
        };
        const auto wx = weights(px - x0), wy = weights(py - y0);
        double sum = 0;
        for (int j = 0; j < 4; ++j)
            for (int i = 0; i < 4; ++i)
                sum += wx[std::size_t(i)] * wy[std::size_t(j)] * double(points_.at(x0 + i - 1, y0 + j - 1));
        return sum;
    }

private:
    static void blur(ImageF& picture)
    {
        ImageF copy = picture;
        for (int pass = 0; pass < 2; ++pass) {
            std::swap(copy, picture);
            for (int y = 1; y < picture.height() - 1; ++y)
                for (int x = 1; x < picture.width() - 1; ++x)
                    picture.at(x, y) = 0.5f * copy.at(x, y) + 0.25f * (pass ? copy.at(x - 1, y) + copy.at(x + 1, y)
                                                                            : copy.at(x, y - 1) + copy.at(x, y + 1));
        }
    }

    ImageF points_;  // two a pixel
};

struct Weather {
    int strokes = 0;       // a frame
    double noise = 0;      // standard deviation
    double movers = 0;     // share of the area
    double breathing = 0;  // gain 1 +- that
    int channels = 3;
};

/// Where a frame's points lie in the scene.
using Path = std::function<std::array<double, 2>(double x, double y)>;

/// frame(p) = scene(path(p)), and what the weather adds.
ImageF filmed(const Scene& scene, int width, int height, const Path& path, int k, const Weather& weather)
{
    Uniform uniform(unsigned(k) * 7919u + 17u);
    ImageF frame(width, height, weather.channels);
    const double gain = 1 + weather.breathing * std::sin(k * 1.3);
    std::vector<double> row(std::size_t(width) * std::size_t(height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto at = path(x + 0.5, y + 0.5);
            row[std::size_t(y * width + x)] = scene(at[0], at[1]);
        }
    // Movers with a pattern of their own, each frame further by its own step.
    const int side = std::max(8, std::min(width, height) / 6);
    const int movers = int(weather.movers * width * height / (side * side));
    Uniform place(5);
    for (int n = 0; n < movers; ++n) {
        const double x0 = place(-side / 2.0, width - side / 2.0), y0 = place(-side / 2.0, height - side / 2.0);
        const double speed = place(2, 6);
        const int left = int(std::fmod(x0 + speed * k, width)), top = int(y0);
        for (int y = std::max(0, top); y < std::min(height, top + side); ++y)
            for (int x = std::max(0, left); x < std::min(width, left + side); ++x)
                row[std::size_t(y * width + x)] =
                    0.4 + 0.2 * std::sin((x - left) * 0.7 + n) * std::cos((y - top) * 0.5);
    }
    for (int n = 0; n < weather.strokes; ++n) {
        const double cx = uniform(0, width), cy = uniform(0, height), slant = uniform(0.1, 0.2);
        const double halfLength = uniform(6, 25), halfWidth = uniform(0.5, 1.5), alpha = uniform(0.15, 0.6);
        for (int y = std::max(0, int(cy - halfLength)); y < std::min(height, int(cy + halfLength)); ++y) {
            const double middle = cx + (y - cy) * slant;
            for (int x = std::max(0, int(middle) - 3); x < std::min(width, int(middle) + 4); ++x) {
                const double inside = std::clamp(halfWidth + 0.5 - std::abs(x - middle), 0.0, 1.0);
                double& value = row[std::size_t(y * width + x)];
                value += alpha * inside * (0.95 - value);
            }
        }
    }
    for (std::size_t i = 0; i < row.size(); ++i)
        for (int c = 0; c < weather.channels; ++c)
            frame.data()[i * std::size_t(weather.channels) + std::size_t(c)] =
                float(gain * row[i] * (1 - 0.1 * c) + weather.noise * uniform.normal());
    return frame;
}

Homography shift(double x, double y) { return {{1, 0, x, 0, 1, y, 0, 0, 1}}; }

/// Rotation [rad], scale and perspective [1/px] about the middle of the picture, then a shift.
Homography motion(int width, int height, double angle, double scale, double px, double py, double x, double y)
{
    const double cx = width / 2.0, cy = height / 2.0, c = scale * std::cos(angle), s = scale * std::sin(angle);
    // T(centre + shift) * [c -s 0; s c 0; px py 1] * T(-centre)
    const double tx = cx + x, ty = cy + y, w = 1 - px * cx - py * cy;
    const double m2 = -c * cx + s * cy, m5 = -s * cx - c * cy;
    return {{c + tx * px, -s + tx * py, m2 + tx * w, s + ty * px, c + ty * py, m5 + ty * w, px, py, w}};
}

/// rms distance in the scene, over the frame, between where it was put against a reference and where it is.
double errorOf(const Homography& found, const Homography& reference, const Homography& truth, int width, int height)
{
    double squares = 0;
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 9; ++x) {
            const auto inReference = found(width * x / 8.0, height * y / 8.0);
            const auto a = reference(inReference[0], inReference[1]), b = truth(width * x / 8.0, height * y / 8.0);
            squares += (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
        }
    return std::sqrt(squares / 81);
}

struct Shot {
    int width = 320, height = 240;
    std::vector<Homography> truth;
    std::vector<ImageF> frames;

    Shot(int w, int h, std::vector<Homography> path, const Weather& weather)
        : width(w), height(h), truth(std::move(path))
    {
        const Scene scene(w, h);
        for (std::size_t k = 0; k < truth.size(); ++k) frames.push_back(filmed(scene, w, h, truth[k], int(k), weather));
    }
    /// Of where frames were put against the reference: worst over the frames [px].
    double worstError(const std::vector<FrameAlignment>& found, std::size_t reference = 0) const
    {
        double worst = 0;
        for (std::size_t k = 0; k < truth.size(); ++k) {
            EXPECT_TRUE(found[k].found) << "frame " << k;
            worst = std::max(worst, errorOf(found[k].referenceFromFrame, truth[reference], truth[k], width, height));
        }
        return worst;
    }
};

std::vector<Homography> shaken(int width, int height)
{
    return {shift(0, 0),
            motion(width, height, 0.004, 1.0, 0, 0, 1.3, -0.7),
            motion(width, height, -0.01, 1.01, 2e-5, -1e-5, -4.2, 3.1),
            motion(width, height, 0.02, 0.98, -4e-5, 3e-5, 6.5, 5.5),
            motion(width, height, -0.03, 1.03, 5e-5, 5e-5, -11.2, 8.4),
            motion(width, height, -0.02, 1.02, 3e-5, 6e-5, -8.8, 2.9),
            motion(width, height, -0.005, 1.005, 0, 2e-5, 0.4, -3.3)};
}

TEST(FrameAlignment, CameraThatStandsIsLeftAlone)
{
    const Shot shot(320, 240, std::vector<Homography>(7), {.strokes = 150, .noise = 0.01});
    const auto found = alignFrames(shot.frames, 1);
    const double worst = shot.worstError(found);
    EXPECT_LT(worst, 0.02);
    for (const FrameAlignment& a : found) {
        EXPECT_LT(a.motion_px, 0.06);
        EXPECT_GT(a.inlierShare, 0.8);
        EXPECT_LT(a.residual_px, 0.15);
    }
    EXPECT_EQ(found[1].motion_px, 0);
}

TEST(FrameAlignment, FindsShiftsOfAFractionOfAPixel)
{
    const Shot shot(320, 240, {shift(0, 0), shift(0.3, 0), shift(0, -0.3), shift(0.5, 0.5), shift(-0.1, 0.7)}, {});
    EXPECT_LT(shot.worstError(alignFrames(shot.frames, 0)), 0.01);
}

TEST(FrameAlignment, FindsRotationZoomAndPerspectiveUnderRainAndNoise)
{
    const Shot shot(320, 240, shaken(320, 240), {.strokes = 150, .noise = 0.02});
    const auto found = alignFrames(shot.frames, 0);
    EXPECT_LT(shot.worstError(found), 0.05);
    for (const FrameAlignment& a : found) EXPECT_GT(a.inlierShare, 0.8);
}

TEST(FrameAlignment, ErrorsOfAPanDoNotAddUp)
{
    std::vector<Homography> path;
    for (int k = 0; k < 60; ++k) path.push_back(shift(2.5 * k, 0.4 * std::sin(k)));
    const Shot shot(320, 240, path, {.strokes = 100, .noise = 0.01, .channels = 1});
    EXPECT_LT(shot.worstError(alignFrames(shot.frames, 0)), 0.05);
}

TEST(FrameAlignment, BreathingExposureDoesNotMoveFrames)
{
    const Shot shot(320, 240, shaken(320, 240), {.noise = 0.01, .breathing = 0.1});
    EXPECT_LT(shot.worstError(alignFrames(shot.frames, 0)), 0.05);
}

TEST(FrameAlignment, MoversDoNotDragFramesAlong)
{
    const Shot shot(320, 240, shaken(320, 240), {.strokes = 100, .noise = 0.01, .movers = 0.2});
    const auto found = alignFrames(shot.frames, 2);
    EXPECT_LT(shot.worstError(found, 2), 0.05);
    for (const std::size_t k : {0, 1, 3, 4, 5, 6}) {
        EXPECT_GT(found[k].inlierShare, 0.5);
        EXPECT_LT(found[k].inlierShare, 0.95);
    }
}

TEST(FrameAlignment, FramesThatShareNothingWithTheReferenceArePlacedByOthers)
{
    std::vector<Homography> path;
    for (int k = 0; k < 31; ++k) path.push_back(shift(9.0 * k, 0.5 * std::sin(k)));
    const Shot shot(240, 180, path, {.strokes = 34, .noise = 0.01, .channels = 1});
    EXPECT_LT(shot.worstError(alignFrames(shot.frames, 0)), 0.2);
    EXPECT_LT(shot.worstError(alignFrames(shot.frames, 15), 15), 0.1);
}

TEST(FrameAlignment, FramesOfOtherThingsAreNotFoundAndCostNoOthers)
{
    Shot shot(320, 240, shaken(320, 240), {.noise = 0.01});
    shot.frames[1] = ImageF(320, 240, 3);
    shot.frames[4] = filmed(Scene(320, 240, 99), 320, 240, shift(0, 0), 4, {.noise = 0.01});
    const auto found = alignFrames(shot.frames, 0);
    for (std::size_t k = 0; k < found.size(); ++k) {
        const bool other = k == 1 || k == 4;
        EXPECT_EQ(found[k].found, !other) << k;
        if (other)
            EXPECT_EQ(found[k].referenceFromFrame.m, Homography().m) << k;
        else
            EXPECT_LT(errorOf(found[k].referenceFromFrame, {}, shot.truth[k], 320, 240), 0.05) << k;
    }
}

// Linear, with lamps, dark or offset: the same scene.
TEST(FrameAlignment, RangeOfValuesDoesNotMatter)
{
    const Shot shot(320, 240, shaken(320, 240), {.noise = 0.005});
    const std::vector<std::function<float(float)>> ranges = {
        [](float v) { return 3e-5f * v; }, [](float v) { return v * v * v + (v > 0.9f ? 1e4f : 0.0f); },
        [](float v) { return 1e6f * v - 3e5f; }, [](float v) { return 1 - v; }};
    for (std::size_t r = 0; r < ranges.size(); ++r) {
        Shot coded = shot;
        for (ImageF& frame : coded.frames)
            for (float& value : frame.values()) value = ranges[r](value);
        EXPECT_LT(coded.worstError(alignFrames(coded.frames, 0)), 0.05) << "range " << r;
    }
}

// A relief seen from places apart: no homography explains it, and the frame says so.
TEST(FrameAlignment, ParallaxShows)
{
    const Scene scene(320, 240);
    for (const double apart : {2.0, 5.0, 15.0}) {
        std::vector<ImageF> frames;
        for (int k = 0; k < 7; ++k) {
            const Path relief = [&](double x, double y) -> std::array<double, 2> {
                return {x + apart * k / 6 * (1 + std::sin(x / 30) * std::sin(y / 25)), y};
            };
            frames.push_back(filmed(scene, 320, 240, relief, k, {.noise = 0.005}));
        }
        const FrameAlignment last = alignFrames(frames, 0).back();
        EXPECT_TRUE(!last.found || last.residual_px > 0.4 || last.inlierShare < 0.7)
            << apart << ": residual " << last.residual_px << ", share " << last.inlierShare;
    }
}

TEST(FrameAlignment, IsTheSameForAnyNumberOfThreads)
{
    const Shot shot(160, 120, shaken(160, 120), {.strokes = 30, .noise = 0.01});
    const auto all = alignFrames(shot.frames, 3);
    const ThreadLimit one(1);
    const auto alone = alignFrames(shot.frames, 3);
    for (std::size_t k = 0; k < all.size(); ++k) {
        EXPECT_EQ(all[k].referenceFromFrame.m, alone[k].referenceFromFrame.m);
        EXPECT_EQ(all[k].found, alone[k].found);
        EXPECT_EQ(all[k].residual_px, alone[k].residual_px);
        EXPECT_EQ(all[k].inlierShare, alone[k].inlierShare);
    }
}

void expectSane(const std::vector<FrameAlignment>& found)
{
    for (const FrameAlignment& a : found) {
        for (const double v : a.referenceFromFrame.m) EXPECT_TRUE(std::isfinite(v));
        EXPECT_TRUE(std::isfinite(a.residual_px) && std::isfinite(a.motion_px));
        EXPECT_TRUE(a.inlierShare >= 0 && a.inlierShare <= 1);
        if (!a.found) {
            EXPECT_EQ(a.referenceFromFrame.m, Homography().m);
        }
    }
}

TEST(FrameAlignment, PicturesWithoutTextureAreNotFound)
{
    const std::vector<std::array<int, 2>> sizes = {{1, 1},   {1, 200},  {200, 1}, {2, 2},   {7, 5},
                                                   {16, 16}, {17, 300}, {24, 24}, {64, 48}, {320, 240}};
    for (const auto& [width, height] : sizes) {
        Uniform uniform(11);
        std::vector<std::vector<ImageF>> clips(4);
        for (int k = 0; k < 6; ++k) {
            clips[0].emplace_back(width, height, 3);                           // black
            clips[1].emplace_back(width, height, 1, 0.7f + 0.01f * float(k));  // constant, and breathing
            ImageF noise(width, height, 1), stripes(width, height, 1);
            for (float& value : noise.values()) value = float(uniform.normal());
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) stripes.at(x, y) = float(std::sin((x + k) * 0.5));
            clips[2].push_back(std::move(noise));
            clips[3].push_back(std::move(stripes));  // which slide along themselves
        }
        for (std::size_t c = 0; c < clips.size(); ++c) {
            const auto found = alignFrames(clips[c], 2);
            expectSane(found);
            for (std::size_t k = 0; k < found.size(); ++k)
                EXPECT_EQ(found[k].found, k == 2) << width << " x " << height << ", clip " << c << ", frame " << k;
        }
    }
}

TEST(FrameAlignment, HugeAndInfiniteValuesAreSane)
{
    Shot shot(64, 48, std::vector<Homography>(5), {.noise = 0.01});
    shot.frames[1].at(20, 20) = std::numeric_limits<float>::infinity();
    shot.frames[2].at(30, 30) = std::numeric_limits<float>::max();
    shot.frames[3].at(10, 30) = -std::numeric_limits<float>::max();
    shot.frames[4].at(10, 30) = std::numeric_limits<float>::quiet_NaN();
    for (int reference = 0; reference < 5; ++reference) expectSane(alignFrames(shot.frames, reference));
}

TEST(FrameAlignment, OneFrameIsItsOwnReference)
{
    const auto found = alignFrames(std::vector<ImageF>(1, ImageF(64, 48, 3, 0.5f)), 0);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_TRUE(found[0].found);
}

TEST(FrameAlignment, RefusesWhatItCannotUse)
{
    const std::vector<ImageF> frames(3, ImageF(32, 32, 3));
    EXPECT_THROW(alignFrames(frames, -1), Error);
    EXPECT_THROW(alignFrames(frames, 3), Error);
    EXPECT_THROW(alignFrames(std::vector<ImageF>{}, 0), Error);
    EXPECT_THROW(alignFrames(std::vector<ImageF>{ImageF(32, 32, 3), ImageF(32, 31, 3)}, 0), Error);
    EXPECT_THROW(alignFrames(std::vector<ImageF>{ImageF(32, 32, 3), ImageF(32, 32, 1)}, 0), Error);
    EXPECT_THROW(alignFrames(std::vector<ImageF>(2, ImageF(32, 32, 4)), 0), Error);
    EXPECT_THROW(alignFrames(frames, 0, {.mostFeatures = 7}), Error);
    EXPECT_THROW(alignFrames(frames, 0, {.minOverlap = 1.1}), Error);
    EXPECT_THROW(alignFrames(frames, 0, {.polishes = -1}), Error);
    EXPECT_THROW(alignFrames(frames, 0, {.minInlierShare = -0.1}), Error);
}

TEST(FrameAlignment, InverseTakesPointsBack)
{
    const Homography h = motion(320, 240, 0.3, 1.2, 2e-4, -3e-4, 12, -5), back = h.inverse();
    for (const auto& [x, y] : {std::array{0.0, 0.0}, std::array{320.0, 240.0}, std::array{17.5, 200.25}}) {
        const auto there = h(x, y), again = back(there[0], there[1]);
        EXPECT_NEAR(again[0], x, 1e-9);
        EXPECT_NEAR(again[1], y, 1e-9);
    }
    EXPECT_EQ((Homography{{0, 0, 0, 0, 0, 0, 0, 0, 0}}.inverse().m), Homography().m);
}

TEST(FrameWarp, IdentityAndWholeShiftsAreExact)
{
    const ImageF frame = filmed(Scene(40, 30), 40, 30, shift(0, 0), 0, {.noise = 0.1});
    ImageF covered;
    const ImageF same = matte::warpToReference(frame, {}, &covered);
    EXPECT_TRUE(std::equal(same.values().begin(), same.values().end(), frame.values().begin()));
    for (const float c : covered.values()) EXPECT_EQ(c, 1);

    const ImageF moved = matte::warpToReference(frame, shift(3, -2), &covered);  // frame (x, y) at (x + 3, y - 2)
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 40; ++x) {
            const bool reaches = x >= 3 && y < 28;
            EXPECT_EQ(covered.at(x, y), reaches ? 1 : 0);
            for (int c = 0; c < 3; ++c) EXPECT_EQ(moved.at(x, y, c), reaches ? frame.at(x - 3, y + 2, c) : 0);
        }
}

TEST(FrameWarp, BringsAFrameOntoTheReferenceAndBack)
{
    const Scene scene(320, 240);
    const Homography h = shaken(320, 240)[3];
    const ImageF reference = filmed(scene, 320, 240, shift(0, 0), 0, {});
    const ImageF frame = filmed(scene, 320, 240, h, 0, {});
    ImageF there, back;
    const ImageF aligned = matte::warpToReference(frame, h, &there),
                 again = matte::warpFromReference(aligned, h, &back);
    ImageF inner = matte::warpFromReference(there, h);  // below 1 where the cubic met what was not covered
    double toReference = 0, toFrame = 0, plain = 0;
    int countThere = 0, countBack = 0;
    for (int y = 0; y < 240; ++y)
        for (int x = 0; x < 320; ++x) {
            const auto square = [](float a, float b) { return double(a - b) * double(a - b); };
            plain += square(frame.at(x, y), reference.at(x, y));
            if (there.at(x, y) == 1) toReference += square(aligned.at(x, y), reference.at(x, y)), ++countThere;
            if (back.at(x, y) == 1 && std::abs(inner.at(x, y) - 1) < 1e-4f)
                toFrame += square(again.at(x, y), frame.at(x, y)), ++countBack;
        }
    EXPECT_GT(countThere, 320 * 240 * 0.85);
    EXPECT_GT(countBack, 320 * 240 * 0.85);
    const double before = std::sqrt(plain / (320 * 240));
    EXPECT_LT(std::sqrt(toReference / countThere), 0.05 * before);
    EXPECT_LT(std::sqrt(toFrame / countBack), 0.05 * before);
}

// What alignment is for.
TEST(FrameWarp, MedianOfAlignedFramesIsTheScene)
{
    const Shot shot(320, 240, shaken(320, 240), {.strokes = 40, .noise = 0.01});
    const auto found = alignFrames(shot.frames, 0);
    std::vector<ImageF> aligned;
    for (std::size_t k = 0; k < found.size(); ++k)
        aligned.push_back(matte::warpToReference(shot.frames[k], found[k].referenceFromFrame));
    const ImageF truth = filmed(Scene(320, 240), 320, 240, shift(0, 0), 0, {});
    const auto rms = [&](const ImageF& picture) {
        double squares = 0;
        int count = 0;
        for (int y = 30; y < 210; ++y)
            for (int x = 30; x < 290; ++x, ++count) squares += std::pow(double(picture.at(x, y) - truth.at(x, y)), 2);
        return std::sqrt(squares / count);
    };
    const double before = rms(matte::temporalMedian(shot.frames)), after = rms(matte::temporalMedian(aligned));
    EXPECT_LT(after, 0.2 * before);
    EXPECT_LT(after, 0.012);
}

}  // namespace
}  // namespace virga
