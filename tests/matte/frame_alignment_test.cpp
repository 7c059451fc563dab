// Footage of a camera that moves over a scene whose every point is known: blotches, boards with edges and grain, drawn
// at twice the resolution, so that a frame is that scene at the points where the truth says.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
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
    static constexpr int margin = 200;  // round the reference [px]

    Scene(int width, int height, unsigned seed = 3) : points_((width + 2 * margin) * 2, (height + 2 * margin) * 2, 1)
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
        const double px = 2 * (x + margin) - 0.5, py = 2 * (y + margin) - 0.5;
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

/// frame(p) = scene(referenceFromFrame(p)), and what the weather adds.
ImageF filmed(const Scene& scene, int width, int height, const Homography& referenceFromFrame, int k,
              const Weather& weather)
{
    Uniform uniform(unsigned(k) * 7919u + 17u);
    ImageF frame(width, height, weather.channels);
    const double gain = 1 + weather.breathing * std::sin(k * 1.3);
    std::vector<double> row(std::size_t(width) * std::size_t(height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const auto at = referenceFromFrame(x + 0.5, y + 0.5);
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
        EXPECT_LT(a.motion_px, 0.05);
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

}  // namespace
}  // namespace virga
