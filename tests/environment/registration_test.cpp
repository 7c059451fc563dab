// Rotations and focal lengths of cameras whose truth is known.
#include "environment/Registration.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "World.h"
#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::environment {
namespace {

using test::degree;
using test::filmed;
using test::look;

constexpr int width = 320, height = 180;

/// A generator for noise on pixels.
struct Noise {
    std::uint64_t state = 1;
    float operator()()
    {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return float(double(state >> 11) * 0x1p-53 - 0.5);
    }
};

struct Shot {
    std::vector<glm::dmat3> truth;
    std::vector<Features> features;
};

/// Films the world with noise, an exposure that goes up and down, and somebody who walks along in front of the camera.
Shot shoot(double fov, const std::vector<glm::dmat3>& rotations)
{
    Shot shot{rotations, {}};
    Noise noise;
    for (std::size_t i = 0; i < rotations.size(); ++i) {
        ImageF frame = filmed(width, height, fov, rotations[i], 1.0 + 0.3 * std::sin(0.9 * double(i)));
        const int left = int(i * 23) % (width - 40);
        for (int y = 60; y < height; ++y) {
            for (int x = left; x < left + 40; ++x) {
                for (int c = 0; c < 3; ++c)
                    frame.at(x, y, c) = 0.2f + 0.2f * float((x - left) / 8 % 2) * float(y / 8 % 2);
            }
        }
        for (float& value : frame.values()) value = std::max(0.0f, value + 0.02f * noise());
        shot.features.emplace_back(frame);
    }
    return shot;
}

std::vector<glm::dmat3> pan(int frames, double stepDegrees)
{
    std::vector<glm::dmat3> rotations;
    for (int i = 0; i < frames; ++i)
        rotations.push_back(look(i * stepDegrees * degree, 2.0 * std::sin(0.7 * i) * degree));
    return rotations;
}

/// Largest angle by which rotations between frames are off [rad].
double worstTurn(const Registration& found, const std::vector<glm::dmat3>& truth)
{
    double worst = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
            const glm::dmat3 a = glm::transpose(*found.worldFromCamera[k]) * *found.worldFromCamera[i];
            const glm::dmat3 b = glm::transpose(truth[k]) * truth[i];
            for (int c = 0; c < 3; ++c) worst = std::max(worst, glm::length(a[c] - b[c]));
        }
    }
    return worst;
}

TEST(Registration, APanOfUnknownFocalLength)
{
    for (const double fov : {35.0, 65.0}) {
        const Shot shot = shoot(fov * degree, pan(12, 0.12 * fov));
        const Registration found = registerTurns(shot.features);
        EXPECT_EQ(found.joined, 12);
        EXPECT_TRUE(found.fovIsEstimated);
        const double focal = 1 / std::tan(0.5 * found.horizontalFov), truth = 1 / std::tan(0.5 * fov * degree);
        EXPECT_NEAR(focal / truth, 1.0, 0.02) << fov;
        EXPECT_LT(worstTurn(found, shot.truth), 0.5 * degree) << fov;
        EXPECT_LT(found.residual_px, 1.0);
        EXPECT_FALSE(found.closes);
        // The first looks down -z, and the horizon is level.
        EXPECT_NEAR((*found.worldFromCamera[0])[2].x, 0.0, 1e-12);
        EXPECT_NEAR(glm::length(*found.worldFromCamera[6] * glm::dvec3(0, 1, 0) - shot.truth[6][1]), 0.0, 1.5 * degree);
    }
}

TEST(Registration, AllTheWayAroundItCloses)
{
    const Shot shot = shoot(70 * degree, pan(18, 20));
    const Registration found = registerTurns(shot.features);
    EXPECT_EQ(found.joined, 18);
    EXPECT_TRUE(found.closes);
    const double focal = 1 / std::tan(0.5 * found.horizontalFov), truth = 1 / std::tan(35 * degree);
    EXPECT_NEAR(focal / truth, 1.0, 0.01);
    EXPECT_LT(worstTurn(found, shot.truth), 0.4 * degree);
}

TEST(Registration, AKnownFocalLengthIsKept)
{
    const Shot shot = shoot(50 * degree, pan(4, 3));
    const Registration found = registerTurns(shot.features, {.horizontalFov = 50 * degree});
    EXPECT_NEAR(found.horizontalFov, 50 * degree, 1e-12);
    EXPECT_FALSE(found.fovIsEstimated);
    EXPECT_LT(worstTurn(found, shot.truth), 0.2 * degree);
}

TEST(Registration, ACameraThatHardlyTurnsTellsNoFocalLength)
{
    const Shot shot = shoot(40 * degree, {look(0, 0), look(0.1 * degree, 0), look(0.1 * degree, 0.1 * degree)});
    const Registration found = registerTurns(shot.features);
    EXPECT_EQ(found.joined, 3);
    EXPECT_FALSE(found.fovIsEstimated);
    EXPECT_NEAR(found.horizontalFov, 60 * degree, 1e-6);
}

TEST(Registration, ACutLeavesTheLargerPart)
{
    std::vector<glm::dmat3> rotations = pan(7, 6);
    for (int i = 0; i < 3; ++i) rotations.push_back(look((170 + 5 * i) * degree, 0));
    const Shot shot = shoot(50 * degree, rotations);
    const Registration found = registerTurns(shot.features, {.horizontalFov = 50 * degree});
    EXPECT_EQ(found.joined, 7);
    for (std::size_t i = 0; i < rotations.size(); ++i) EXPECT_EQ(found.worldFromCamera[i].has_value(), i < 7) << i;
    ASSERT_EQ(found.gaps.size(), 1u);
    EXPECT_EQ(found.gaps[0], (std::pair<std::size_t, std::size_t>(6, 7)));
}

TEST(Registration, ThreadsDoNotShow)
{
    const std::vector<glm::dmat3> rotations = pan(4, 7);
    const Registration many = registerTurns(shoot(60 * degree, rotations).features);
    const ThreadLimit one(1);
    const Registration single = registerTurns(shoot(60 * degree, rotations).features);
    EXPECT_EQ(many.horizontalFov, single.horizontalFov);
    for (std::size_t i = 0; i < rotations.size(); ++i) EXPECT_EQ(*many.worldFromCamera[i], *single.worldFromCamera[i]);
}

TEST(Registration, PicturesWithoutFeaturesDoNotJoin)
{
    const ImageF black(width, height, 3), wall(width, height, 3, 0.4f),
        broken(width, height, 4, std::numeric_limits<float>::quiet_NaN()), dot(1, 1, 3, 1.0f);
    EXPECT_EQ(Features(black).count(), 0);
    EXPECT_EQ(Features(wall).count(), 0);
    EXPECT_EQ(Features(broken).count(), 0);
    EXPECT_EQ(Features(dot).count(), 0);
    const std::vector<Features> frames{Features(black), Features(wall), Features(broken)};
    const Registration found = registerTurns(frames);
    EXPECT_EQ(found.joined, 1);
    EXPECT_FALSE(found.fovIsEstimated);
    EXPECT_EQ(judgeMotion(frames, 1.0).motion, CameraMotion::Unclear);
    EXPECT_EQ(registerTurns({frames.data(), 1}).joined, 1);

    EXPECT_THROW(registerTurns({}), Error);
    EXPECT_THROW(registerTurns(std::vector<Features>{Features(black), Features(dot)}), Error);
    EXPECT_THROW(registerTurns(frames, {.horizontalFov = 3.1}), Error);
}

// ---------------------------------------------------------------------------------------------------------------------

TEST(Motion, StillTurningTravelling)
{
    const double fov = 60 * degree;
    const Shot still = shoot(fov, std::vector<glm::dmat3>(5, look(0.3, 0)));
    EXPECT_EQ(judgeMotion(still.features, fov).motion, CameraMotion::Still);
    EXPECT_EQ(judgeMotion(shoot(fov, pan(5, 4)).features, fov).motion, CameraMotion::Turning);

    // Straight on between two walls: what is near grows faster than what is far.
    std::vector<Features> drive;
    for (int i = 0; i < 5; ++i) {
        ImageF frame(width, height, 3);
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                const glm::dvec3 ray((x + 0.5 - 0.5 * width) / width, (0.5 * height - y - 0.5) / width, -0.85);
                const double depth = 3.0 / std::max(0.05, std::abs(ray.x));
                const glm::dvec3 at = ray / 0.85 * depth + glm::dvec3(0, 0, -2.0 * i);
                const double value = test::hashed(std::int64_t(std::floor(at.x)), std::int64_t(std::floor(at.y * 1.5)),
                                                  std::int64_t(std::floor(at.z * 0.7)), 5);
                for (int c = 0; c < 3; ++c) frame.at(x, y, c) = float(0.1 + 0.7 * value);
            }
        }
        drive.emplace_back(frame);
    }
    const MotionReport report = judgeMotion(drive, fov);
    EXPECT_EQ(report.motion, CameraMotion::Travelling);
    EXPECT_GT(report.expansion, 0.01);
}

}  // namespace
}  // namespace virga::environment
