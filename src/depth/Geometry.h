// Geometry that depth implies, for a pinhole camera with square pixels and its principal point in the middle:
// pixel (x, y) centred at (x + 1/2, y + 1/2), focal length f = (width / 2) / tan(horizontalFov / 2) in pixels, so that
// the point at depth z is z ((x + 1/2 - width/2) / f, -(y + 1/2 - height/2) / f, -1) in camera axes.
#pragma once

#include <array>

#include "core/Image.h"

namespace virga::depth {

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

/// The same for a camera that is level but for its pitch.
ImageF groundDepth(int width, int height, double horizontalFov, double cameraHeight, double pitch);

/// How much each pixel's surface faces up: max(0, normal . up), 0 for the sky. W x H x 1, in [0, 1].
/// The normal is the cross product of two differences of neighbouring points, on each axis towards the neighbour that
/// is nearer in inverse depth; so a pixel at an edge takes the side that it belongs to, and planes are exact. A surface
/// a single pixel wide has no neighbour of its own and is wrong. `up` in camera axes, any length. The reference for the
/// GPU's splash pass. metres: as sanitizeDepth leaves them. Throws as groundDepth does.
ImageF upFacing(ConstImageViewF metres, double horizontalFov, const Vector& up);

}  // namespace virga::depth
