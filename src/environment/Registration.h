// Which way a camera looked, frame by frame, from the frames alone: for panoramas of footage that nobody tracked.
//
// Brown and Lowe 2007, "Automatic panoramic image stitching using invariant features": SIFT features are matched
// between frames; a rotation for each pair by random sampling; the focal length that explains all pairs best; then
// rotations and focal length together by least squares over all matches (bundle adjustment); then the horizon is
// levelled, as people hold cameras level. One focal length for all frames, no lens distortion, principal point in the
// middle.
//
// Deterministic, also across thread counts.
#pragma once

#include <glm/mat3x3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/Image.h"

namespace virga::environment {

/// Places in a frame that can be found again in other frames.
class Features {
public:
    /// plate  scene-linear RGB or RGBA of any size; NaN and infinite pixels are taken for black. A picture without
    ///        corners (black, a wall, a blur) has few features or none.
    explicit Features(ConstImageViewF plate);

    int count() const;
    int width() const { return width_; }
    int height() const { return height_; }

    struct Data;
    const Data& data() const { return *data_; }

private:
    int width_, height_;
    std::shared_ptr<const Data> data_;
};

/// How frames of one camera differ.
enum class CameraMotion {
    Unclear,     ///< too little in the frames to tell
    Still,       ///< locked off, or hand-held with hardly any motion
    Turning,     ///< a rotation explains what moves
    Travelling,  ///< parallax or expansion: the camera drives, walks or zooms
};

struct MotionReport {
    CameraMotion motion = CameraMotion::Unclear;
    double shift = 0;  ///< median distance that a feature moves from the first frame to the others, over the width
    double turnedShare = 0;     ///< share of the matched features that the best rotations explain
    double expansion = 0;       ///< median growth of distances between features from a frame to the next
    int frames = 0, pairs = 0;  ///< looked at; and pairs of frames that show the same
};

/// Judges frames that are in order of time. `horizontalFov` [rad] as far as it is known.
MotionReport judgeMotion(std::span<const Features> frames, double horizontalFov);

struct RegistrationOptions {
    std::optional<double> horizontalFov;  ///< [rad]; without it the focal length is estimated
    double usualFov =
        1.0471975511965976;  ///< [rad], 60 degrees: where the estimate starts, and stays if nothing is known
};

struct Registration {
    /// The camera's rotation in each frame; nothing for frames that share too little with the others. The first that
    /// has one looks along azimuth 0, -z (docs/conventions.md); up is the direction that the cameras' sides are level
    /// to.
    std::vector<std::optional<glm::dmat3>> worldFromCamera;
    double horizontalFov = 0;  ///< [rad]
    bool fovIsEstimated = false;
    double fovDeviation = 0;  ///< standard deviation of an estimated focal length, over it
    double residual_px = 0;   ///< root mean square of what the rotations leave, in pixels of the frames
    int matches = 0;          ///< that the rotations explain
    int joined = 0;           ///< frames that have a rotation
    bool closes = false;      ///< the camera went all the way around, and frames far apart in time were joined
    /// Neighbours in time that could not be joined to each other; a frame between them might help.
    std::vector<std::pair<std::size_t, std::size_t>> gaps;
};

/// Rotations of frames that are in order of time and of one size. Frames that do not join the largest group that hangs
/// together have none. Throws Error(InvalidArgument) for no frame, sizes that differ or a field of view out of range.
Registration registerTurns(std::span<const Features> frames, const RegistrationOptions& options = {});

}  // namespace virga::environment
