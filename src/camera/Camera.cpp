#include "camera/Camera.h"

#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <glm/trigonometric.hpp>

namespace virga::camera {

Projection projectionFromFocal(int width, int height, double focal_px) noexcept
{
    return {width, height, focal_px, 0.5 * width, 0.5 * height, double(width), 1};
}

Projection projectionFromHorizontalFov(int width, int height, double horizontalFov) noexcept
{
    return projectionFromFocal(width, height, 0.5 * width / std::tan(0.5 * horizontalFov));
}

Projection projectionFromVerticalFov(int width, int height, double verticalFov) noexcept
{
    return projectionFromFocal(width, height, 0.5 * height / std::tan(0.5 * verticalFov));
}

Projection partOf(const Projection& frame, double scale, const Window& region) noexcept
{
    Projection part;
    part.width = region.width;
    part.height = region.height;
    part.focal_px = frame.focal_px * scale;
    part.axisX_px = frame.axisX_px * scale - region.x;
    part.axisY_px = frame.axisY_px * scale - region.y;
    part.frameWidth_px = frame.frameWidth_px * scale;
    part.scale = frame.scale * scale;
    return part;
}

Borders bordersOf(const Projection& p, double beyond) noexcept
{
    return {-(p.axisX_px + beyond) / p.focal_px, (p.width - p.axisX_px + beyond) / p.focal_px,
            -(p.height - p.axisY_px + beyond) / p.focal_px, (p.axisY_px + beyond) / p.focal_px};
}

Projected project(const Projection& projection, const glm::dvec3& p) noexcept
{
    const double depth = -p.z;
    const double scale = projection.focal_px / depth;
    return {{projection.axisX_px + scale * p.x, projection.axisY_px - scale * p.y}, depth};
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

}  // namespace virga::camera
