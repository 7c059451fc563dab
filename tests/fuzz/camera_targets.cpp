#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/matrix.hpp>

#include "camera/ColmapTrack.h"
#include "camera/RenderMatrices.h"
#include "camera/TrackFile.h"
#include "fuzz/Targets.h"

namespace virga::fuzz {

namespace {

using namespace std::string_literals;

void requireGood(const camera::Pose& pose)
{
    require(!pose.verticalFov || (*pose.verticalFov > 0 && *pose.verticalFov < 3.15), "the field of view is an angle");
    for (int i = 0; i < 3; ++i) {
        require(std::isfinite(pose.position[i]), "the camera is somewhere");
        for (int j = 0; j < 3; ++j)
            require(std::abs(pose.worldFromCamera[i][j]) < 1 + 1e-9, "the camera's axes have length 1");
    }
    require(std::abs(glm::determinant(pose.worldFromCamera) - 1) < 1e-2, "the camera is not mirrored");
}

/// The first byte says how the text is read; a COLMAP model is two texts with a zero byte between.
camera::Track trackOf(std::uint8_t choice, std::string_view text)
{
    if ((choice & 1) != 0) {
        const std::size_t cut = std::min(text.find('\0'), text.size());
        return camera::parseColmap(text.substr(0, cut), text.substr(std::min(cut + 1, text.size())), "model").track;
    }
    camera::TrackOptions options;
    options.matrix = {(choice & 2) != 0, (choice & 4) != 0, (choice & 8) != 0};
    options.up = camera::WorldUp(choice >> 4 & 3);
    options.rotationOrder = camera::RotationOrder((choice >> 4) % 6);
    return camera::parseTrack(text, "track", options).track;
}

void takeTrack(std::string_view input)
{
    if (input.empty()) return;
    answers({ErrorCode::Input}, [&] {
        const camera::Track track = trackOf(std::uint8_t(input[0]), input.substr(1));
        require(!track.empty(), "a track has a pose");
        for (const auto& [frame, pose] : track.poses()) requireGood(pose);
    });
}

/// Sixteen numbers of worldToCamera, and sixteen of worldToNDC if there are that many, as an EXR's header holds them.
void takeRenderMatrices(std::string_view input)
{
    float numbers[32] = {};
    std::memcpy(numbers, input.data(), std::min(input.size(), sizeof numbers));
    camera::RenderMatrices matrices;
    if (input.size() >= sizeof numbers / 2) std::copy_n(numbers, 16, matrices.worldToCamera.emplace().begin());
    if (input.size() >= sizeof numbers) std::copy_n(numbers + 16, 16, matrices.worldToNdc.emplace().begin());
    if (matrices.empty()) return;
    answers({ErrorCode::Input}, [&] { requireGood(camera::poseFromRenderMatrices(matrices, "plate")); });
}

std::string bytesOf(const std::vector<float>& numbers)
{
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
}

}  // namespace

std::vector<Target> cameraTargets()
{
    const std::vector<float> toCamera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 2, -1, 5, 1};
    std::vector<float> both = toCamera;
    for (const float number : {1.2f, 0.f, 0.f, 0.f, 0.f, -2.f, 0.f, 0.f, -0.5f, -0.5f, -1.f, -1.f, 0.f, 0.f, 0.f, 1.f})
        both.push_back(number);
    return {
        {"camera-track",
         takeTrack,
         {"\x10"
          "1 0 2 0 -5 30 0 40\n2 0.5 2 -1 -5 33 0 40\n# end\n"s,
          "\0"
          "1 1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1 40\n2 1 0 0 5 0 1 0 6 0 0 1 8 0 0 0 1 40\n"s,
          "\0"
          "1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 5 0 1 0 6 0 0 1 8\n"s,
          "\x06"
          "{\"frames\": [{\"frame\": 7, \"matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,2,3,1]], \"vfov_deg\": 40}]}"s,
          "\x08"
          "{\"1001\": [1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1]}"s,
          "\0"
          "[[1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1]]"s,
          "\0"
          "{\"camera_angle_x\": 0.8, \"w\": 640, \"h\": 480, \"frames\": [{\"file_path\": \"a/f_0012.png\", "
          "\"transform_matrix\": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]}"s,
          "\x01"
          "# lenses\n1 OPENCV 640 480 500 501 320 240 0.1 -0.01 0 0\n"
          "\0"
          "1 1 0 0 0 0.5 -1 2 1 a/frame_0001.png\n10 20 -1\n2 0.7071 0 0.7071 0 0 0 0 1 frame_0002.png\n\n"s},
         {"frames", "matrix", "transform_matrix", "file_path", "vfov_deg", "camera_angle_y", "fl_y", "SIMPLE_PINHOLE",
          "1e308", "nan", "inf", "[", "{", "0 0 0 1"}},
        {"render-matrices", takeRenderMatrices, {bytesOf(toCamera), bytesOf(both)}, {}}};
}

}  // namespace virga::fuzz
