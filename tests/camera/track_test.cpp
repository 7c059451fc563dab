// The same camera in every format that is read, and what is no camera.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <random>

#include "camera/TrackFile.h"
#include "core/Error.h"
#include "support/Files.h"

namespace virga::camera {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

struct Walk {
    FrameNumber frame;
    glm::dvec3 place, angles_deg;  // about x, y, z; ZXY
};
const Walk walk[] = {
    {-2, {0, 0, 0}, {0, 0, 0}}, {1, {1.5, -2, 30}, {10, 200, -30}}, {7, {-4, 0.25, 1e3}, {-80, 5, 170}}};
constexpr double fov_deg = 40;

glm::dmat4 matrixOf(const Walk& w)
{
    glm::dmat4 m(rotationZXY(glm::radians(w.angles_deg.x), glm::radians(w.angles_deg.y), glm::radians(w.angles_deg.z)));
    m[3] = glm::dvec4(w.place, 1);
    return m;
}

void expectWalk(const Track& track, double tolerance, double scale = 1)
{
    ASSERT_EQ(track.poses().size(), std::size(walk));
    for (const Walk& w : walk) {
        ASSERT_TRUE(track.poses().contains(w.frame)) << w.frame;
        const Pose& pose = track.poses().at(w.frame);
        const glm::dmat4 expected = matrixOf(w);
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(pose.position[c], scale * w.place[c], tolerance * std::max(1.0, std::abs(w.place[c])));
            for (int r = 0; r < 3; ++r) EXPECT_NEAR(pose.worldFromCamera[c][r], expected[c][r], tolerance);
        }
        ASSERT_TRUE(pose.verticalFov.has_value());
        EXPECT_NEAR(*pose.verticalFov, glm::radians(fov_deg), tolerance);
    }
}

std::string chan()
{
    std::string text;
    for (const Walk& w : walk)
        text += fmt::format("{} {} {} {} {} {} {} {}\n", w.frame, w.place.x, w.place.y, w.place.z, w.angles_deg.x,
                            w.angles_deg.y, w.angles_deg.z, fov_deg);
    return text;
}

std::string numbers(const glm::dmat4& m, bool byColumns, const char* between)
{
    std::string text;
    for (int i = 0; i < 16; ++i)
        text += fmt::format("{}{}", i > 0 ? between : "", byColumns ? m[i / 4][i % 4] : m[i % 4][i / 4]);
    return text;
}

std::string matrices(const MatrixLayout& layout, bool asJson)
{
    // The other handedness of the axes: y and z of the camera reversed.
    const glm::dmat4 flip({1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1});
    std::string text = asJson ? "{\"frames\": [" : "# a comment\n";
    for (const Walk& w : walk) {
        glm::dmat4 m = matrixOf(w);
        if (layout.looksAlongZ) m = m * flip;
        if (layout.worldToCamera) m = glm::inverse(m);
        text += asJson ? fmt::format("{}{{\"frame\": {}, \"vfov_deg\": {}, \"matrix\": [{}]}}", &w == walk ? "" : ", ",
                                     w.frame, fov_deg, numbers(m, layout.byColumns, ","))
                       : fmt::format("{} {} {}\n", w.frame, numbers(m, layout.byColumns, " "), fov_deg);
    }
    return text + (asJson ? "]}" : "");
}

/// COLMAP: the quaternion (w first) and translation that take the world to a camera with y down, z forward.
void writeColmap(const TemporaryFolder& folder)
{
    const double fy = 0.5 * 480 / std::tan(0.5 * glm::radians(fov_deg));
    folder.write("cameras.txt", fmt::format("# id model w h\n1 PINHOLE 640 480 {} {} 320 240\n", fy, fy));
    std::string text = "# images\n";
    for (const Walk& w : walk) {
        const glm::dmat4 flip({1, 0, 0, 0}, {0, -1, 0, 0}, {0, 0, -1, 0}, {0, 0, 0, 1});
        const glm::dmat4 m = glm::inverse(matrixOf(w) * flip);
        const glm::dquat q = glm::quat_cast(glm::dmat3(m));
        text += fmt::format("{} {} {} {} {} {} {} {} 1 left/shot.{:04d}.png\n1.5 2.5 -1 3 4 7\n", 10 + w.frame, q.w,
                            q.x, q.y, q.z, m[3][0], m[3][1], m[3][2], w.frame + 100);
    }
    folder.write("images.txt", text);
}

TEST(TrackFile, TheSameCameraInEveryFormat)
{
    expectWalk(parseTrack(chan(), "a.chan", {}).track, 1e-9);
    for (const bool byColumns : {false, true})
        for (const bool worldToCamera : {false, true})
            for (const bool looksAlongZ : {false, true})
                for (const bool asJson : {false, true}) {
                    SCOPED_TRACE(fmt::format("{} {} {} {}", byColumns, worldToCamera, looksAlongZ, asJson));
                    TrackOptions options;
                    options.matrix = {byColumns, worldToCamera, looksAlongZ};
                    expectWalk(parseTrack(matrices(options.matrix, asJson), "m", options).track, 1e-9);
                }
    const TemporaryFolder folder;
    writeColmap(folder);
    TrackOptions options;
    options.frameOffset = -100;
    expectWalk(readTrack(folder / "", options).track, 1e-9);
}

TEST(TrackFile, MatricesOfThreeRowsAndWithoutNumbers)
{
    const std::string kitti = "1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 8 0 1 0 9 0 0 1 10\n";
    const Track track = parseTrack(kitti, "poses.txt", {}).track;
    EXPECT_EQ(track.firstFrame(), 0);
    EXPECT_EQ(track.poses().at(1).position, glm::dvec3(8, 9, 10));
    const Track json = parseTrack("[[[1,0,0,5],[0,1,0,6],[0,0,1,7],[0,0,0,1]]]", "poses.json", {}).track;
    EXPECT_EQ(json.poses().at(0).position, glm::dvec3(5, 6, 7));
    const Track keyed = parseTrack("{\"1001\": [1,0,0,5, 0,1,0,6, 0,0,1,7, 0,0,0,1]}", "poses.json", {}).track;
    EXPECT_EQ(keyed.poses().at(1001).position, glm::dvec3(5, 6, 7));
}

TEST(TrackFile, ScaleUpAndOffset)
{
    TrackOptions options;
    options.scale = 0.01;
    expectWalk(parseTrack(chan(), "cm.chan", options).track, 1e-9, 0.01);

    // A camera at height 2 that looks to the horizon, said with z up: the same as with y up.
    options = {};
    options.up = WorldUp::Z;
    const Pose pose = parseTrack("1 0 -5 2 90 0 0\n", "z.chan", options).track.at(1);
    EXPECT_NEAR(pose.position.y, 2, 1e-12);
    EXPECT_NEAR(pose.position.z, 5, 1e-12);
    EXPECT_NEAR(pose.worldFromCamera[1].y, 1, 1e-12);  // its up is ours
    // Every choice turns the world and does not mirror it.
    for (const WorldUp up : {WorldUp::Y, WorldUp::Z, WorldUp::MinusY, WorldUp::MinusZ}) {
        options.up = up;
        EXPECT_NEAR(glm::determinant(parseTrack(chan(), "a.chan", options).track.at(1).worldFromCamera), 1, 1e-12);
    }
    options = {};
    options.frameOffset = 1000;
    EXPECT_EQ(parseTrack(chan(), "a.chan", options).track.firstFrame(), 998);
}

TEST(TrackFile, RotationOrders)
{
    const double x = 0.3, y = -1.1, z = 2.0;
    const glm::dmat3 rx = rotation(RotationOrder::XYZ, x, 0, 0), ry = rotation(RotationOrder::XYZ, 0, y, 0),
                     rz = rotation(RotationOrder::XYZ, 0, 0, z);
    const auto expectSame = [](const glm::dmat3& a, const glm::dmat3& b) {
        for (int c = 0; c < 3; ++c)
            for (int r = 0; r < 3; ++r) EXPECT_NEAR(a[c][r], b[c][r], 1e-14);
    };
    expectSame(rotation(RotationOrder::ZXY, x, y, z), rotationZXY(x, y, z));
    expectSame(rotation(RotationOrder::XYZ, x, y, z), rz * ry * rx);
    expectSame(rotation(RotationOrder::XZY, x, y, z), ry * rz * rx);
    expectSame(rotation(RotationOrder::YXZ, x, y, z), rz * rx * ry);
    expectSame(rotation(RotationOrder::YZX, x, y, z), rx * rz * ry);
    expectSame(rotation(RotationOrder::ZYX, x, y, z), rx * ry * rz);
}

TEST(TrackFile, WhatIsNoCameraIsNamedWithItsLine)
{
    const auto said = [](const std::string& text, const TrackOptions& options = {}) {
        const std::string sentence = sentenceOf(ErrorCode::Input, [&] { parseTrack(text, "bad", options); });
        EXPECT_SAYS(sentence, "camera track 'bad'");
        return sentence;
    };
    const std::string good = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n";
    EXPECT_SAYS(said(good + "1 0 0 0 0 1 0 0 0 0 nan 0 0 0 0 1\n"), "line 2");
    EXPECT_SAYS(said(good + "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0\n"), "line 2");
    EXPECT_SAYS(said("1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1\n"), "line 1");    // singular
    EXPECT_SAYS(said("-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"), "line 1");   // mirrored
    EXPECT_SAYS(said("1 0.1 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"), "line 1");  // sheared
    EXPECT_SAYS(said("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0.5 1\n"), "line 1");  // perspective
    EXPECT_SAYS(said("5 " + good + "5 " + good), "line 2");              // twice the same frame
    EXPECT_SAYS(said("[[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0]]"), "15 numbers");
    EXPECT_SAYS(said("[[1,0,0,0, 0,1,0,0, 0,0,\"a\",0, 0,0,0,1]]"), "is not a number");
    EXPECT_SAYS(said("{\"frames\": [{\"frame\": 1}]}"), "frames[0]");
    EXPECT_SAYS(said("{\"frames\": 3}"), "\"frames\"");
    EXPECT_SAYS(said("[1, 2"), "is not JSON");
    EXPECT_SAYS(said("[]"), "no frame");
    EXPECT_SAYS(said(""), "no frame");
    const TemporaryFolder folder;
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readTrack(folder / "", {}); }), "cameras.txt");
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readTrack(folder.write("a.abc", "Ogawa"), {}); }), "Alembic");
    writeColmap(folder);
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readTrack(folder / "images.txt", {}); }), "name its folder");
    folder.write("cameras.txt", "1 FISHEYE 640 480 1 2 3 4\n");
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readTrack(folder / "", {}); }), "FISHEYE");
}

}  // namespace
}  // namespace virga::camera
