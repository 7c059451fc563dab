// Camera tracks from other programs. The format is told by the content, the name only says what it is not:
//
//   Nuke .chan      lines of `frame tx ty tz rx ry rz [vertical field of view]`, units and degrees
//   matrix list     text or JSON, camera/MatrixTrack.h
//   COLMAP          a folder with cameras.txt and images.txt, camera/ColmapTrack.h
//
// Each parser is a pure function of text and options; `name` is what its sentences call the file. All throw
// Error(Input) naming the file, the line and what is wrong with it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "camera/Camera.h"

namespace virga::camera {

/// Which way is up in the file's world; ours has +y up.
enum class WorldUp { Y, Z, MinusY, MinusZ };

/// The order in which a .chan's rotations are applied: with ZXY first z, then x, then y, R = Ry Rx Rz on column
/// vectors.
enum class RotationOrder { XYZ, XZY, YXZ, YZX, ZXY, ZYX };

/// How a list of matrices is to be read.
struct MatrixLayout {
    bool byColumns = false;  ///< the numbers stand column by column: the translation is 13th to 15th, not 4th 8th 12th
    bool worldToCamera = false;  ///< the matrices take points from the world to the camera, not back
    bool looksAlongZ = false;    ///< the camera looks along its +z with y down (OpenCV), not down -z with y up (OpenGL)
};

struct TrackOptions {
    double scale = 1;             ///< metres in a unit of the file, > 0
    WorldUp up = WorldUp::Y;      ///< of the file's world
    FrameNumber frameOffset = 0;  ///< added to the file's frame numbers
    RotationOrder rotationOrder = RotationOrder::ZXY;
    MatrixLayout matrix;
};

/// A track and what must be said of it: what was ignored or assumed, a sentence each.
struct TrackReading {
    Track track;
    std::vector<std::string> notes;
    std::string format;  ///< "Nuke .chan", "matrix list", "COLMAP"
};

/// R on column vectors, angles in radians.
glm::dmat3 rotation(RotationOrder order, double rx, double ry, double rz) noexcept;

/// '#' starts a comment. In the file's own units and world: the options' scale, up and offset are not applied.
Track parseChan(std::string_view text, const std::string& name, RotationOrder order = RotationOrder::ZXY);

/// Text of a .chan or a matrix list, whichever it is, with the options applied.
TrackReading parseTrack(std::string_view text, const std::string& name, const TrackOptions& options);

/// A file or COLMAP's folder. Throws Error(Input) too if it cannot be read.
TrackReading readTrack(const std::string& path, const TrackOptions& options);

/// A track of the file's world in ours: metres, +y up, frame numbers shifted.
Track inOurWorld(const Track& track, const TrackOptions& options);

}  // namespace virga::camera
