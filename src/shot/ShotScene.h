// A shot made ready to render: its inputs read, its physics set up, no device opened. What the compositor and the
// reference have in common.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera/Camera.h"
#include "environment/Panorama.h"
#include "grade/ColorTransfer.h"
#include "shot/DepthSource.h"
#include "shot/FramePlan.h"
#include "shot/LightsFile.h"
#include "shot/PlateSamples.h"
#include "shot/RainModel.h"
#include "shot/Settings.h"
#include "shot/ShotLight.h"

namespace virga::shot {

/// What a shot is, besides its settings.
struct Shot {
    int width = 0, height = 0;
    double fps = 24;
    FrameNumber firstFrame = 0;
    camera::Track track{};  ///< in our world; empty: --camera's file, or none
    /// Pixels on each side that are rendered with the frame: pictures are that much larger, the lens stays the frame's.
    int marginX = 0, marginY = 0;
};

/// The camera of a shot without a track stands still at the origin; --ground gives its height and pitch.
camera::Pose standingPose(const Settings& settings);
/// Exposure time [s] from --exposure or --shutter.
double exposureOf(const Settings& settings, double fps);

struct ShotScene {
    /// Reads track, environment and stills and makes the plan; of a pass-through nothing else. samples: see Compositor;
    /// kept: see ShotLight. Throws Error naming the setting or file.
    ShotScene(const Settings& settings, const Shot& shot, const Wanted& wanted, const PlateSamples& samples,
              const KeptFiles& kept = {});

    camera::Projection projectionAt(const camera::Pose& pose) const;
    particles::Exposure exposureAt(FrameNumber frame) const;
    environment::PlateView viewOf(ConstImageViewF plate, FrameNumber frame) const;
    /// Extinction of the air near the scene's lamps [1/m]: the fog's, or the mean of the undrawn rain's over 100 m.
    double extinctionAround(const particles::Exposure& exposure) const;
    /// Optical depth [1] of the fog in front of what stands at `depth_m`; infinity is the sky.
    double fogOpticalDepth(double depth_m, const particles::Exposure& exposure) const;
    /// How far the fog in front of something reaches [m]: its depth, or less where only a ground plane is known.
    double fogDepth(double depth_m) const;

    Settings settings;
    Shot shot;
    camera::Track track;
    FramePlan plan;
    std::optional<RainModel> rain;
    std::optional<ShotLight> light;
    std::optional<DepthSource> depth;
    std::vector<SceneLight> lamps;
    grade::ColorLut lut;
    std::string lightSource;  ///< for the report

private:
    void makeLight(const std::vector<PlateSamples::Frame>& samples, const Wanted& wanted, const KeptFiles& kept);
};

}  // namespace virga::shot
