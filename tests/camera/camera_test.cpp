#include "camera/Camera.h"
#include "camera/TrackFile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/Files.h"

namespace virga::camera {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;
constexpr double pi = std::numbers::pi;

void expectNear(const glm::dvec3& a, const glm::dvec3& b, double tolerance)
{
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "axis " << i;
}

Pose rolled(double degrees, double x = 0)
{
    Pose pose;
    pose.position = {x, 0, 0};
    pose.worldFromCamera = rotationZXY(0, 0, glm::radians(degrees));
    return pose;
}

TEST(Projection, FieldsOfViewReachThePicturesEdges)
{
    for (const double fov_deg : {1.0, 35.0, 90.0, 170.0}) {
        const double half = 0.5 * glm::radians(fov_deg);
        const Projection wide = projectionFromHorizontalFov(1920, 1080, 2 * half);
        EXPECT_NEAR(project(wide, {5 * std::tan(half), 0, -5}).px.x, 1920, 1e-9);
        const Projection high = projectionFromVerticalFov(1920, 1080, 2 * half);
        EXPECT_NEAR(project(high, {0, 5 * std::tan(half), -5}).px.y, 0, 1e-9);  // up is the top row
    }
}

TEST(Projection, TheAxisIsTheMiddleAndWhatIsBehindSaysSo)
{
    const Projection p = projectionFromHorizontalFov(640, 480, 1);
    const Projected ahead = project(p, {0, 0, -7});
    EXPECT_EQ(ahead.px, glm::dvec2(320, 240));
    EXPECT_EQ(ahead.depth, 7);
    EXPECT_GT(project(p, {1, 0, -7}).px.x, 320);
    EXPECT_LT(project(p, {0, 1, -7}).px.y, 240);
    EXPECT_LT(project(p, {0, 0, 2}).depth, 0);
}

// Streaks of single drops computed apart from this code; their camera has y down and z forward, ours y up and -z
// forward.
TEST(Projection, DropsStreakAsTheReferenceSays)
{
    std::ifstream file(VIRGA_TEST_DATA "/geometry_streaks.json");
    const auto table = nlohmann::json::parse(file);
    ASSERT_GE(table["streaks"].size(), 16u);
    for (const auto& s : table["streaks"]) {
        const int width = s["width_px"], height = s["height_px"];
        const Projection p = projectionFromFocal(width, height, s["f_px"]);
        const auto point = [&](const char* name) {
            return glm::dvec3(s[name][0].get<double>(), -s[name][1].get<double>(), -s[name][2].get<double>());
        };
        const glm::dvec3 start = point("start_camera_m");
        // The way in the world, seen by a camera that looks down by `pitch`.
        const double t = s["exposure_s"], v = s["v_m_s"], pitch = s["pitch_rad"];
        const glm::dvec3 way =
            t * glm::dvec3(s["wind_xz_m_s"][0].get<double>(), -v, -s["wind_xz_m_s"][1].get<double>());
        const Pose pose = pitchedPose({0, 0, 0}, pitch);
        const glm::dvec3 end = start + glm::transpose(pose.worldFromCamera) * way;
        expectNear(end, point("end_camera_m"), 1e-9);

        const glm::dvec2 a = project(p, start).px, b = project(p, end).px;
        for (int i = 0; i < 2; ++i) {
            EXPECT_NEAR(a[i], s["start_px"][i].get<double>(), 1e-6);
            EXPECT_NEAR(b[i], s["end_px"][i].get<double>(), 1e-6);
        }
        EXPECT_NEAR(glm::length(b - a), s["length_px"].get<double>(), 1e-6);
        EXPECT_NEAR(p.focal_px * v * t / s["Z_m"].get<double>(), s["level_length_px"].get<double>(), 1e-9);
    }
}

TEST(Rotation, OrderIsZThenXThenY)
{
    // By hand, a quarter turn each. Roll first: x becomes y. Tilt of a quarter about x then takes y to z. Pan of a
    // quarter about y takes z to x.
    expectNear(rotationZXY(0, 0, pi / 2) * glm::dvec3(1, 0, 0), {0, 1, 0}, 1e-15);
    expectNear(rotationZXY(pi / 2, 0, pi / 2) * glm::dvec3(1, 0, 0), {0, 0, 1}, 1e-15);
    expectNear(rotationZXY(pi / 2, pi / 2, pi / 2) * glm::dvec3(1, 0, 0), {1, 0, 0}, 1e-15);
    const double rx = 0.3, ry = -1.1, rz = 2.2;
    const glm::dmat3 product = rotationZXY(0, ry, 0) * rotationZXY(rx, 0, 0) * rotationZXY(0, 0, rz);
    for (int c = 0; c < 3; ++c) expectNear(rotationZXY(rx, ry, rz)[c], product[c], 1e-15);
}

TEST(Rotation, PitchLooksDown)
{
    const Pose pose = pitchedPose({1, 2, 3}, glm::radians(30.0));
    expectNear(pose.worldFromCamera * glm::dvec3(0, 0, -1), {0, -0.5, -std::sqrt(0.75)}, 1e-15);
    EXPECT_EQ(pose.position, glm::dvec3(1, 2, 3));
}

TEST(Track, InterpolatesBetweenFramesAndHoldsOutside)
{
    const Track track({{10, rolled(0, 1)}, {14, rolled(80, 3)}});
    EXPECT_EQ(track.firstFrame(), 10);
    EXPECT_EQ(track.lastFrame(), 14);
    EXPECT_FALSE(track.isStatic());
    for (const double frame : {10.0, 10.25, 11.5, 13.999, 14.0}) {
        const double t = (frame - 10) / 4;
        const Pose pose = track.at(frame), expected = rolled(80 * t, 1 + 2 * t);
        expectNear(pose.position, expected.position, 1e-12);
        for (int c = 0; c < 3; ++c) expectNear(pose.worldFromCamera[c], expected.worldFromCamera[c], 1e-12);
    }
    EXPECT_EQ(track.at(-1e9).position, track.at(10).position);
    EXPECT_EQ(track.at(9.5).position, track.at(10).position);
    EXPECT_EQ(track.at(1e9).worldFromCamera, track.at(14).worldFromCamera);
}

TEST(Track, MeetsItsOwnFramesBitForBit)
{
    const Track track({{0, rolled(12.3, 0.1)}, {1, rolled(45.6, 0.7)}, {2, rolled(-33, 0.3)}});
    for (const int frame : {0, 1, 2}) {
        const Pose expected = frame == 0 ? rolled(12.3, 0.1) : frame == 1 ? rolled(45.6, 0.7) : rolled(-33, 0.3);
        EXPECT_EQ(track.at(frame).worldFromCamera, expected.worldFromCamera);
        EXPECT_EQ(track.at(frame).position, expected.position);
    }
}

TEST(Track, TurnsTheShortWayAndStaysARotation)
{
    const Track track({{0, rolled(170)}, {1, rolled(-170)}});  // 20 degrees apart through 180, not 340 through 0
    expectNear(track.at(0.5).worldFromCamera * glm::dvec3(1, 0, 0), {-1, 0, 0}, 1e-12);
    const glm::dmat3 m = track.at(0.37).worldFromCamera;
    EXPECT_NEAR(glm::determinant(m), 1, 1e-12);
    EXPECT_NEAR(glm::dot(m[0], m[1]), 0, 1e-12);
}

TEST(Track, ZoomsWhereBothEndsSayHow)
{
    Pose wide = rolled(0), narrow = rolled(0);
    wide.verticalFov = 1.0;
    narrow.verticalFov = 0.5;
    EXPECT_NEAR(*Track({{0, wide}, {2, narrow}}).at(1).verticalFov, 0.75, 1e-15);
    EXPECT_FALSE(Track({{0, wide}, {2, narrow}}).isStatic());
    EXPECT_FALSE(Track({{0, wide}, {2, rolled(0)}}).at(1).verticalFov.has_value());
}

TEST(Track, StandsStillWhenAllPosesAreEqual)
{
    EXPECT_TRUE(Track().isStatic());
    EXPECT_TRUE(Track().empty());
    EXPECT_EQ(Track().at(5).position, glm::dvec3(0));
    EXPECT_TRUE(Track({{3, rolled(5)}}).isStatic());
    EXPECT_TRUE(Track({{3, rolled(5)}, {9, rolled(5)}}).isStatic());
}

TEST(Chan, ReadsPlacesAnglesAndFieldOfView)
{
    const TemporaryFolder folder;
    const Track track = readTrack(folder.write("a.chan",
                                              "# frame tx ty tz rx ry rz vfov\n"
                                              "\n"
                                              "1 0.5 -2 3e1 10 20 30 40   # the first\n"
                                              "\t3\t1 2 3 0 0 0 50\r\n"
                                              "-2 0 0 0 0 0 0\n"), {}).track;
    EXPECT_EQ(track.firstFrame(), -2);
    EXPECT_EQ(track.lastFrame(), 3);
    const Pose pose = track.at(1);
    EXPECT_EQ(pose.position, glm::dvec3(0.5, -2, 30));
    EXPECT_NEAR(*pose.verticalFov, glm::radians(40.0), 1e-15);
    EXPECT_FALSE(track.at(-2).verticalFov.has_value());
    // R = Ry Rx Rz, with each factor written out.
    const double x = glm::radians(10.0), y = glm::radians(20.0), z = glm::radians(30.0);
    const glm::dmat3 rx(1, 0, 0, 0, std::cos(x), std::sin(x), 0, -std::sin(x), std::cos(x));
    const glm::dmat3 ry(std::cos(y), 0, -std::sin(y), 0, 1, 0, std::sin(y), 0, std::cos(y));
    const glm::dmat3 rz(std::cos(z), std::sin(z), 0, -std::sin(z), std::cos(z), 0, 0, 0, 1);
    const glm::dmat3 expected = ry * rx * rz;
    for (int c = 0; c < 3; ++c) expectNear(pose.worldFromCamera[c], expected[c], 1e-15);
}

TEST(Chan, ErrorsNameFileLineAndFault)
{
    const TemporaryFolder folder;
    const auto sentence = [&](const std::string& text) {
        const std::string path = folder.write("track.chan", text);
        const std::string said = sentenceOf(ErrorCode::Input, [&] { readTrack(path, {}); });
        EXPECT_SAYS(said, path);
        return said;
    };
    const std::string good = "# comment\n1 0 0 0 0 0 0\n";
    EXPECT_SAYS(sentence(good + "2 0 0 zero 0 0 0\n"), "line 3: 'zero' is not a number");
    EXPECT_SAYS(sentence(good + "2 0 0 nan 0 0 0\n"), "line 3: 'nan'");
    EXPECT_SAYS(sentence(good + "2 0 inf 0 0 0 0\n"), "line 3: 'inf'");
    EXPECT_SAYS(sentence(good + "2 0 0 1e999 0 0 0\n"), "line 3: '1e999'");
    EXPECT_SAYS(sentence(good + "2 0 0 0 0\n"), "line 3: 5 numbers");
    EXPECT_SAYS(sentence(good + "2.5 0 0 0 0 0 0\n"), "line 3: frame 2.5 is not a whole number");
    EXPECT_SAYS(sentence(good + "2 0 0 0 0 0 0 180\n"), "line 3: vertical field of view 180");
    EXPECT_SAYS(sentence("# nothing but this\n\n"), "no frame");
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [] { readTrack("/no/such/track.chan", {}); }), "/no/such/track.chan");
}

}  // namespace
}  // namespace virga::camera
