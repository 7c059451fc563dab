// COLMAP's text model (https://colmap.github.io/format.html): cameras.txt has a lens a line, images.txt two lines an
// image, its pose and its points. A pose is the quaternion and translation that take the world to a camera with x
// right, y down, z forward. The scale of such a world is whatever the reconstruction chose: --camera-scale makes it
// metres.
#pragma once

#include "camera/TrackFile.h"

namespace virga::camera {

/// The two files' texts; `name` is their folder. An image's frame is the last number in its name. The vertical field of
/// view is of the lens's fy and height. Lenses: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV; a note names
/// distortion, pixels that are not square and a principal point off the middle, which are all ignored, in pixels.
/// In the file's own units and world. Throws Error(Input) naming the file and the line.
TrackReading parseColmap(std::string_view cameras, std::string_view images, const std::string& name);

}  // namespace virga::camera
