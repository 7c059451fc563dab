// Geometry that depth implies, for a pinhole camera with square pixels and its principal point in the middle:
// pixel (x, y) centred at (x + 1/2, y + 1/2), focal length f = (width / 2) / tan(horizontalFov / 2) in pixels, so that
// the point at depth z is z ((x + 1/2 - width/2) / f, -(y + 1/2 - height/2) / f, -1) in camera axes.
#pragma once

#include <array>

#include "core/Image.h"

namespace virga::depth {

/// Where a picture that is part of a frame has its optical axis: nothing says that it is in the middle.
struct Lens {
    double focal_px = 0;
    double axisX_px = 0, axisY_px = 0;  ///< from the picture's corner
};
Lens centredLens(int width, int height, double horizontalFov);

/// x right, y up, z towards the viewer.
using Vector = std::array<double, 3>;

/// The world's up in the axes of a level camera that is tilted; positive pitch looks down [rad]. Unit length.
Vector upInCamera(double pitch) noexcept;

/// Depth [m] of an endless flat ground, `cameraHeight` [m] under the camera, whose normal is `up` in camera axes (need
/// not have unit length); +inf where no ground is seen. It has no far end: just under the horizon it is as far as the
/// horizon is thin. horizontalFov [rad] in (0, pi).
/// Throws Error(InvalidArgument) naming the value that is out of range (sizes below 1, height not above 0, fov, zero
/// up).
ImageF groundDepth(int width, int height, double horizontalFov, double cameraHeight, const Vector& up);

/// The same of a part of a frame.
ImageF groundDepth(int width, int height, const Lens& lens, double cameraHeight, const Vector& up);

/// The same for a camera that is level but for its pitch.
ImageF groundDepth(int width, int height, double horizontalFov, double cameraHeight, double pitch);

/// How much each pixel's surface faces up: max(0, normal . up), 0 for the sky. W x H x 1, in [0, 1].
/// The normal is the cross product of two differences of points, one on each axis, between the neighbours `reach`
/// pixels to both sides; where one of them is on another surface (inverse depth off by 3 % or more), between here and
/// the one that is nearer in inverse depth. So a pixel at an edge takes the side that it belongs to, and planes are
/// exact. A surface narrower than `reach` has no neighbour of its own and is wrong. Rendered depth wants a reach of 1;
/// measured depth is stepped and wants about 1 % of the picture's width. `up` in camera axes, any length. metres: as
/// sanitizeDepth leaves them. The reference for the GPU's splash pass. Throws as groundDepth does, and if reach is
/// below 1.
ImageF upFacing(ConstImageViewF metres, double horizontalFov, const Vector& up, int reach = 1);

}  // namespace virga::depth
