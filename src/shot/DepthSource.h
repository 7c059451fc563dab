#pragma once

#include <memory>
#include <optional>
#include <string>

#include "camera/Camera.h"
#include "depth/DepthImage.h"
#include "shot/DepthReader.h"
#include "shot/Settings.h"

namespace virga::shot {

/// Depth for each frame of a shot: from images (one, or one a frame), from a movie, or from a ground plane.
class DepthSource {
public:
    /// Checks what can be checked: the file or the pattern's folder, the text of --ground.
    /// firstPose: where the camera stands in the first frame; the ground is `height` under it.
    /// marginX, marginY: pixels on each side of the frame for which depth is wanted, too (Shot); images end at the frame,
    /// and their last pixels go on.
    /// Throws Error(Input), Error(InvalidArgument).
    DepthSource(const Settings& settings, int width, int height, const camera::Pose& firstPose, int marginX = 0,
                int marginY = 0);

    /// width x height x 1 with the margins [m], +inf sky. The same object is returned while nothing changes, so that it need not be
    /// uploaded again. plate: the frame's pixels, whose edges a smaller depth takes over; isSamePlate: they are those of
    /// the call before. Throws Error(Input) naming the file and the frame.
    std::shared_ptr<const depth::Depth> at(FrameNumber frame, const camera::Pose& pose,
                                           const camera::Projection& projection, ConstImageViewF plate,
                                           bool isSamePlate = false);

private:
    std::shared_ptr<const depth::Depth> fromFile(FrameNumber frame, double focal_px, ConstImageViewF plate,
                                                 bool isSamePlate);
    /// --on-error hold: the nearest earlier depth that can be read, else the nearest later one. why: the sentence of
    /// the one that cannot.
    std::shared_ptr<const depth::Depth> heldFor(FrameNumber frame, const std::string& why, double focal_px,
                                                ConstImageViewF plate);

    Settings settings_;
    std::optional<DepthReader> reader_;  // nothing: a ground plane
    depth::DepthOptions options_;
    int width_, height_, marginX_, marginY_;
    std::optional<double> groundLevel_;  // world y [m]
    std::string lastName_;
    double lastFocal_px_ = 0;
    bool followsPlate_ = false;  // the images are smaller than the plate
    bool saidResampled_ = false, isJudged_ = false;
    bool holds_;  // --on-error hold
    std::optional<camera::Pose> lastPose_;
    std::shared_ptr<const depth::Depth> last_;
};

/// How the settings say that stored depth is to be read; `full` and `focal_px` are the image's. Throws
/// Error(InvalidArgument) for flags that do not go together.
depth::DepthOptions depthOptionsOf(const Settings& settings);

/// "height[,pitch]": camera height over the ground [m], pitch down [deg, 0]. Throws Error(InvalidArgument).
struct Ground {
    double height_m, pitch_deg;
};
Ground parseGround(const std::string& text);

}  // namespace virga::shot
