#include "camera/Camera.h"

#include <cmath>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>
#include <sstream>
#include <vector>

#include "core/Error.h"

namespace virga::camera {

Projection projectionFromHorizontalFov(int width, int height, double horizontalFov) noexcept
{
    return {width, height, 0.5 * width / std::tan(0.5 * horizontalFov)};
}

Projection projectionFromVerticalFov(int width, int height, double verticalFov) noexcept
{
    return {width, height, 0.5 * height / std::tan(0.5 * verticalFov)};
}

Projected project(const Projection& projection, const glm::dvec3& p) noexcept
{
    const double depth = -p.z;
    const double scale = projection.focal_px / depth;
    return {{0.5 * projection.width + scale * p.x, 0.5 * projection.height - scale * p.y}, depth};
}

Pose Track::at(double frame) const
{
    if (poses_.empty()) return {};
    const auto after = poses_.lower_bound(FrameNumber(std::ceil(frame)));
    if (after == poses_.end()) return poses_.rbegin()->second;
    if (after == poses_.begin() || double(after->first) == frame) return after->second;
    const auto before = std::prev(after);
    const double t = (frame - double(before->first)) / double(after->first - before->first);

    Pose pose;
    pose.position = glm::mix(before->second.position, after->second.position, t);
    pose.worldFromCamera = glm::mat3_cast(
        glm::slerp(glm::quat_cast(before->second.worldFromCamera), glm::quat_cast(after->second.worldFromCamera), t));
    if (before->second.verticalFov && after->second.verticalFov)
        pose.verticalFov = glm::mix(*before->second.verticalFov, *after->second.verticalFov, t);
    return pose;
}

bool Track::isStatic() const
{
    for (const auto& [frame, pose] : poses_) {
        const Pose& first = poses_.begin()->second;
        if (pose.position != first.position || pose.worldFromCamera != first.worldFromCamera ||
            pose.verticalFov != first.verticalFov)
            return false;
    }
    return true;
}

glm::dmat3 rotationZXY(double rx, double ry, double rz) noexcept
{
    const auto about = [](double angle, const glm::dvec3& axis) { return glm::mat3_cast(glm::angleAxis(angle, axis)); };
    return about(ry, {0, 1, 0}) * about(rx, {1, 0, 0}) * about(rz, {0, 0, 1});
}

Pose pitchedPose(const glm::dvec3& position, double pitch) noexcept
{
    return {position, rotationZXY(-pitch, 0, 0), std::nullopt};
}

Track readChan(const std::string& path)
{
    std::ifstream file(path);
    if (!file) throw Error(ErrorCode::Input, "camera track '{}' cannot be opened", path);

    std::map<FrameNumber, Pose> poses;
    std::string line;
    for (int lineNumber = 1; std::getline(file, line); ++lineNumber) {
        if (const auto comment = line.find('#'); comment != std::string::npos) line.erase(comment);
        std::istringstream words(line);
        std::vector<double> numbers;
        std::string word;
        while (words >> word) {
            char* end = nullptr;
            const double number = std::strtod(word.c_str(), &end);
            if (*end != '\0' || !std::isfinite(number))
                throw Error(ErrorCode::Input, "camera track '{}', line {}: '{}' is not a number", path, lineNumber,
                            word);
            numbers.push_back(number);
        }
        if (numbers.empty()) continue;
        if (numbers.size() < 7)
            throw Error(ErrorCode::Input,
                        "camera track '{}', line {}: {} numbers, but 'frame tx ty tz rx ry rz [vfov]' needs 7 or 8",
                        path, lineNumber, numbers.size());
        if (std::abs(numbers[0]) > 1e15 || numbers[0] != std::round(numbers[0]))
            throw Error(ErrorCode::Input, "camera track '{}', line {}: frame {} is not a whole number", path,
                        lineNumber, numbers[0]);
        Pose pose;
        pose.position = {numbers[1], numbers[2], numbers[3]};
        pose.worldFromCamera =
            rotationZXY(glm::radians(numbers[4]), glm::radians(numbers[5]), glm::radians(numbers[6]));
        if (numbers.size() > 7) {
            if (numbers[7] <= 0 || numbers[7] >= 180)
                throw Error(ErrorCode::Input,
                            "camera track '{}', line {}: vertical field of view {} deg must be over 0 and under 180",
                            path, lineNumber, numbers[7]);
            pose.verticalFov = glm::radians(numbers[7]);
        }
        poses[FrameNumber(numbers[0])] = pose;
    }
    if (poses.empty()) throw Error(ErrorCode::Input, "camera track '{}' holds no frame", path);
    return Track(std::move(poses));
}

}  // namespace virga::camera
