// Runs the passes of a shot in order: a plate frame in, the finished frame and its layers out.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "camera/Camera.h"
#include "depth/DepthImage.h"
#include "io/Plate.h"
#include "shot/FramePlan.h"
#include "shot/PlateSamples.h"
#include "shot/Settings.h"

namespace virga::shot {

/// What a shot is, besides its settings.
struct Shot {
    int width = 0, height = 0;
    double fps = 24;
    FrameNumber firstFrame = 0;
    camera::Track track{};  ///< in our world; empty: --camera's file, or none
};

struct CompositorOptions {
    Wanted wanted;
    std::string device = "auto";  ///< see makePictureRenderer
    std::string shaderFolder;     ///< see gl::loadShader
};

/// What happened, for the report.
struct CompositorStatistics {
    std::string device;                    ///< see PictureRenderer; empty if nothing is drawn
    std::map<std::string, double> passMs;  ///< summed over the frames
    double renderSeconds = 0;              ///< render() without waiting for the plate
    std::size_t frames = 0, strokes = 0, splashes = 0;
    std::size_t repairedPixels = 0;  ///< NaN, Inf or negative plate pixels that effects would have spread
    depth::DepthCounts depthCounts;  ///< of the last depth image read
    bool depthResampled = false;
    int lightOrder = 0;
    double lightRemainder = 0;   ///< what the order leaves out: rms over the mean radiance
    std::size_t lightCount = 0;  ///< lights of the environment that are shaded one by one
    std::string lightSource;     ///< "frames 0,24,48,72,95 of the plate", "each plate frame: the picture moves", a file
    double fogExtinction_1_m = 0;  ///< mean over the first 100 m
};

/// Belongs to the thread that made it. A frame depends on (settings, samples, frame number, plate frame) alone.
class Compositor {
public:
    /// Reads track, mattes, environment and stills, makes the plan and, unless it is a pass-through, opens the device.
    /// samples: a few frames of the plate for its light and the colour transfer. Without those for the light each frame
    /// is lit by itself; without those for the colour transfer there must be none.
    /// Throws Error naming the setting or file.
    Compositor(const Settings& settings, const Shot& shot, const CompositorOptions& options,
               const PlateSamples& samples);
    ~Compositor();

    const FramePlan& plan() const;

    /// Renders over `plate.pixels`, which are of the shot's size.
    io::RenderedFrame render(io::PlateFrame plate);

    const CompositorStatistics& statistics() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The camera of a shot without a track stands still at the origin; --ground gives its height and pitch.
camera::Pose standingPose(const Settings& settings);
/// Exposure time [s] from --exposure or --shutter.
double exposureOf(const Settings& settings, double fps);

}  // namespace virga::shot
