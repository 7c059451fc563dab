// The camera: a pinhole with square pixels, its exposure, and tracks that move it. docs/conventions.md has the axes:
// world right-handed, +y up; the camera looks down -z; image x right, y down, pixel (0, 0) centred at (0.5, 0.5).
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <optional>

#include "core/FrameRange.h"
#include "core/Window.h"

namespace virga::camera {

/// Where the camera stands and looks. Double precision: a world may be large.
struct Pose {
    glm::dvec3 position{0.0};           ///< [m]
    glm::dmat3 worldFromCamera{1.0};    ///< rotation; columns are the camera's x, y, z axes in the world
    std::optional<double> verticalFov;  ///< [rad], when the track zooms
};

/// What a pose becomes on a picture: a whole frame, or a part of it, or of a smaller copy of it.
struct Projection {
    int width = 0, height = 0;          ///< of the part that is made [px]
    double focal_px = 0;                ///< focal length in pixels: x_px = axisX_px + focal_px * x / depth
    double axisX_px = 0, axisY_px = 0;  ///< where the optical axis meets the picture, from the part's corner
    double frameWidth_px = 0;           ///< of the whole frame at this scale: the sensor's width
    double scale = 1;                   ///< pixels of this picture to one of the frame's, 0 to 1

    /// Of the frame at full scale. What can be seen is judged by it, so that a proxy shows the drops that the frame
    /// has.
    double fullFocal_px() const noexcept { return focal_px / scale; }
};

/// What a picture shows, as x / depth and y / depth of its borders in camera axes. A part beside the axis has a border
/// on the far side of it: then `left` is over 0, or `right` under it.
struct Borders {
    double left, right, bottom, top;
};
/// `beyond` pixels around it, too.
Borders bordersOf(const Projection& projection, double beyond = 0) noexcept;

/// Of a whole frame. horizontalFov in (0, pi) [rad].
Projection projectionFromFocal(int width, int height, double focal_px) noexcept;
Projection projectionFromHorizontalFov(int width, int height, double horizontalFov) noexcept;
Projection projectionFromVerticalFov(int width, int height, double verticalFov) noexcept;
/// A frame's projection at `scale`, of which `region` is made (in pixels at that scale; it may reach beyond the frame).
Projection partOf(const Projection& frame, double scale, const Window& region) noexcept;

/// Depth along -z [m] and place on the picture [px] of a point given in camera axes. depth <= 0 is behind the camera,
/// and then `px` means nothing.
struct Projected {
    glm::dvec2 px;
    double depth;
};
Projected project(const Projection& projection, const glm::dvec3& inCamera) noexcept;

/// A camera that moves: one pose a frame, positions and rotations between frames interpolated (linear, slerp), held
/// before the first and after the last. camera/TrackFile.h reads them.
class Track {
public:
    Track() = default;
    explicit Track(std::map<FrameNumber, Pose> poses) : poses_(std::move(poses)) {}

    /// frame need not be whole: the shutter closes between frames.
    Pose at(double frame) const;
    bool isStatic() const;  ///< all poses equal (or none at all)
    bool empty() const { return poses_.empty(); }
    FrameNumber firstFrame() const { return poses_.begin()->first; }
    FrameNumber lastFrame() const { return poses_.rbegin()->first; }
    const std::map<FrameNumber, Pose>& poses() const { return poses_; }

private:
    std::map<FrameNumber, Pose> poses_;
};

/// R = Ry(ry) Rx(rx) Rz(rz), angles in radians.
glm::dmat3 rotationZXY(double rx, double ry, double rz) noexcept;

/// A level camera tilted: positive pitch looks down [rad].
Pose pitchedPose(const glm::dvec3& position, double pitch) noexcept;

}  // namespace virga::camera
