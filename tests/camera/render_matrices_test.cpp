#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <limits>

#include "camera/RenderMatrices.h"
#include "camera/TrackFile.h"
#include "support/Files.h"

namespace virga::camera {
namespace {

using test::sentenceOf;

const std::string place = "a.0001.exr";
constexpr double verticalFov = 0.6, aspect = 16.0 / 9;

std::vector<Pose> poses()
{
    std::vector<Pose> result;
    for (const auto& [x, y, z, rx, ry, rz] :
         {std::array<double, 6>{0, 0, 0, 0, 0, 0}, {3, 1.7, -20, -10, 35, 2}, {-4e3, 250, 1e4, 40, 170, -80}})
        result.push_back({{x, y, z},
                          rotation(RotationOrder::ZXY, glm::radians(rx), glm::radians(ry), glm::radians(rz)),
                          verticalFov});
    return result;
}

/// As a renderer works it out: what a point of the world is in the axes (x right, y up, z ahead or back).
glm::dmat4 cameraFromWorld(const Pose& pose, bool zAhead)
{
    glm::dmat4 worldFromCamera(pose.worldFromCamera);
    worldFromCamera[3] = glm::dvec4(pose.position, 1);
    glm::dmat4 m = glm::inverse(worldFromCamera);
    if (zAhead) m = glm::dmat4(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1) * m;
    return m;
}

/// Onto the picture: (x, y) from 0 to 1 with y down, or from -1 to 1 with y up; w is the depth.
glm::dmat4 pictureFromWorld(const Pose& pose, bool isNdc)
{
    const double v = 1 / std::tan(0.5 * verticalFov), h = v / aspect, s = isNdc ? 0.5 : 1, c = isNdc ? 0.5 : 0;
    glm::dmat4 p(0.0);
    p[0][0] = s * h;
    p[1][1] = isNdc ? -s * v : v;
    p[2] = {c, c, 1.01, 1};
    p[3][2] = -0.1;
    return p * cameraFromWorld(pose, true);
}

RowMatrix rows(const glm::dmat4& m)
{
    RowMatrix result{};
    for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r) result[std::size_t(4 * c + r)] = m[c][r];
    return result;
}

void expectSame(const Pose& found, const Pose& expected, double tolerance = 1e-9)
{
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(found.position[i], expected.position[i], tolerance * (1 + glm::length(expected.position)));
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(found.worldFromCamera[i][j], expected.worldFromCamera[i][j], tolerance);
    }
}

TEST(RenderMatrices, WorldToCameraGivesThePoseBackInBothHandednesses)
{
    for (const Pose& pose : poses())
        for (const bool zAhead : {true, false})
            for (const double scale : {1.0, 0.01}) {
                const glm::dmat4 m = glm::dmat4(glm::dmat3(scale)) * cameraFromWorld(pose, zAhead);
                const Pose found = poseFromRenderMatrices({rows(m), std::nullopt}, place);
                expectSame(found, pose);
                EXPECT_FALSE(found.verticalFov.has_value());
            }
}

TEST(RenderMatrices, WorldToNdcGivesPoseAndFieldOfView)
{
    for (const Pose& pose : poses())
        for (const bool isNdc : {true, false})
            for (const double factor : {1.0, 40.0}) {  // homogeneous: no factor matters
                const Pose found =
                    poseFromRenderMatrices({std::nullopt, rows(factor * pictureFromWorld(pose, isNdc))}, place);
                expectSame(found, pose, 1e-8);
                EXPECT_NEAR(*found.verticalFov, verticalFov, 1e-9);
            }
}

TEST(RenderMatrices, TheTwoTogether)
{
    const Pose pose = poses()[1];
    const Pose found =
        poseFromRenderMatrices({rows(cameraFromWorld(pose, true)), rows(pictureFromWorld(pose, true))}, place);
    expectSame(found, pose);
    EXPECT_NEAR(*found.verticalFov, verticalFov, 1e-9);
}

TEST(RenderMatrices, FloatsAreGoodToAMillionth)
{
    const Pose pose = poses()[1];
    RowMatrix m = rows(cameraFromWorld(pose, true));
    for (double& value : m) value = float(value);
    const Pose found = poseFromRenderMatrices({m, std::nullopt}, place);
    expectSame(found, pose, 1e-6);
    EXPECT_NEAR(glm::determinant(found.worldFromCamera), 1, 1e-12);
}

TEST(RenderMatrices, WhatIsNoCameraIsRefused)
{
    const Pose pose = poses()[1];
    const auto camera = [&](const glm::dmat4& m) {
        const std::string said = sentenceOf(ErrorCode::Input, [&] {
            poseFromRenderMatrices({rows(m), std::nullopt}, place);
        });
        EXPECT_SAYS(said, "a.0001.exr, worldToCamera");
        return said;
    };
    const auto picture = [&](const glm::dmat4& m) {
        const std::string said = sentenceOf(ErrorCode::Input, [&] {
            poseFromRenderMatrices({std::nullopt, rows(m)}, place);
        });
        EXPECT_SAYS(said, "a.0001.exr, worldToNDC");
        return said;
    };
    glm::dmat4 m = cameraFromWorld(pose, true);
    m[1][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_SAYS(camera(m), "not finite");
    EXPECT_SAYS(camera(glm::dmat4(0.0)), "0 0 0 1");
    m = glm::dmat4(0.0);
    m[3][3] = 1;
    EXPECT_SAYS(camera(m), "singular");
    m = cameraFromWorld(pose, true);
    m[0] *= 1.1;
    EXPECT_SAYS(camera(m), "no rotation");

    m = pictureFromWorld(pose, true);
    m[2][0] = std::numeric_limits<double>::infinity();
    EXPECT_SAYS(picture(m), "not finite");
    EXPECT_SAYS(picture(glm::dmat4(1.0)), "orthographic");
    EXPECT_SAYS(picture(glm::dmat4(0.0)), "orthographic");
    m = pictureFromWorld(pose, true);
    for (int c = 0; c < 4; ++c) m[c][0] = m[c][3];
    EXPECT_SAYS(picture(m), "singular");
    // The same picture of a mirrored world.
    const glm::dmat4 mirror(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
    EXPECT_SAYS(picture(pictureFromWorld(pose, true) * mirror), "left-handed");
    EXPECT_SAYS(picture(pictureFromWorld(pose, false) * mirror), "left-handed");
}

}  // namespace
}  // namespace virga::camera
