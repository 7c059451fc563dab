#pragma once

#include <memory>
#include <optional>
#include <string>

#include "camera/Camera.h"
#include "core/Window.h"
#include "depth/DepthImage.h"
#include "shot/DepthReader.h"
#include "shot/Settings.h"

namespace virga::shot {

/// What of a frame depth is wanted for.
struct DepthWindow {
    int frameWidth = 0, frameHeight = 0;  ///< at the view's scale [px]
    Window region;                        ///< of these pixels; may reach beyond the frame
    double focal_px = 0;                  ///< at that scale
    friend bool operator==(const DepthWindow&, const DepthWindow&) = default;
};

/// Depth for each frame of a shot: from images (one, or one a frame), from a movie, or from a ground plane.
class DepthSource {
public:
    /// Checks what can be checked: the file or the pattern's folder, the text of --ground.
    /// firstPose: where the camera stands in the first frame; the ground is `height` under it.
    /// Throws Error(Input), Error(InvalidArgument).
    /// inMemory: see DepthReader.
    DepthSource(const Settings& settings, const camera::Pose& firstPose,
                std::shared_ptr<const PicturesInMemory> inMemory = nullptr);

    /// Of the window's region, x 1 [m], +inf sky; images end at the frame, and beyond it their last pixels go on. The
    /// same object is returned while nothing changes, so that it need not be uploaded again. plate: the whole frame's
    /// pixels, whose edges a smaller depth takes over; may be empty, then it does not. isSamePlate: they are those of
    /// the call before. Throws Error(Input) naming the file and the frame.
    std::shared_ptr<const depth::Depth> at(FrameNumber frame, const camera::Pose& pose, const DepthWindow& window,
                                           ConstImageViewF plate, bool isSamePlate = false);

    /// Whether the depth may follow the plate's edges: not a ground, nor images that are known to be large enough.
    bool mayFollowPlate() const { return reader_ && (!wholeFrame_ || followsPlate_); }

private:
    std::shared_ptr<const depth::Depth> fromGround(FrameNumber frame, const camera::Pose& pose,
                                                   const DepthWindow& window);
    std::shared_ptr<const depth::Depth> fromFile(FrameNumber frame, const DepthWindow& window, ConstImageViewF plate,
                                                 bool isSamePlate);
    /// Makes wholeFrame_ that of the frame.
    void readFrame(FrameNumber frame, const DepthWindow& window, ConstImageViewF plate, bool isSamePlate);
    /// --on-error hold: the nearest earlier depth that can be read, else the nearest later one. why: the sentence of
    /// the one that cannot.
    std::shared_ptr<const depth::Depth> heldFor(FrameNumber frame, const std::string& why, const DepthWindow& window,
                                                ConstImageViewF plate);

    Settings settings_;
    std::optional<DepthReader> reader_;  // nothing: a ground plane
    depth::DepthOptions options_;
    std::optional<double> groundLevel_;  // world y [m]
    std::string lastName_;
    bool followsPlate_ = false;  // the images are smaller than the plate
    bool saidResampled_ = false, isJudged_ = false;
    bool holds_;  // --on-error hold
    std::optional<camera::Pose> lastPose_;
    DepthWindow lastWindow_;                          // of last_, and but for its region of wholeFrame_
    std::shared_ptr<const depth::Depth> wholeFrame_;  // of lastName_, as large as the frame
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
