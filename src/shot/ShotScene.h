// A shot made ready to render: its inputs read, its physics set up, no device opened. What the compositor and the
// reference have in common.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "camera/Camera.h"
#include "environment/Panorama.h"
#include "grade/ColorTransfer.h"
#include "shot/Dependencies.h"
#include "shot/DepthSource.h"
#include "shot/FramePlan.h"
#include "shot/LightsFile.h"
#include "shot/PicturesInMemory.h"
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
    camera::Track track{};                               ///< in our world; empty: --camera's file, or none
    std::shared_ptr<const PicturesInMemory> inMemory{};  ///< where settings name pictures in it; else null
};

/// The camera of a shot without a track stands still at the origin; --ground gives its height and pitch.
camera::Pose standingPose(const Settings& settings);
/// Exposure time [s] from --exposure or --shutter.
double exposureOf(const Settings& settings, double fps);

/// What a shot is made of: the parts of Dependencies.h. Copies share what is large.
struct SceneParts {
    Settings settings;
    Shot shot;
    camera::Track track;
    FramePlan plan;
    std::shared_ptr<const RainModel> rain;
    std::shared_ptr<ShotLight> light;
    std::shared_ptr<DepthSource> depth;
    std::vector<SceneLight> lamps;
    grade::ColorLut lut;
    std::string lightSource;  ///< for the report
};

struct ShotScene : SceneParts {
    /// Reads track, environment and stills and makes the plan; of a pass-through nothing else. samples: see Compositor;
    /// kept: see ShotLight. Throws Error naming the setting or file.
    ShotScene(const Settings& settings, const Shot& shot, const Wanted& wanted, const PlateSamples& samples,
              const KeptFiles& kept = {});

    /// Other settings: makes anew what depends on those that changed, and returns those parts. If it throws, nothing
    /// is known of the scene but what SceneParts were copied before. samples: as at first.
    unsigned change(const Settings& settings, const PlateSamples& samples);

    /// What is made of each frame from now on: all of it at full scale, unless this is called.
    void look(double scale, const Window& region);
    Window frameWindow() const;  ///< the frame at the scale

    camera::Projection projectionAt(const camera::Pose& pose) const;  ///< of what is made
    particles::Exposure frameExposureAt(FrameNumber frame) const;     ///< of all of it at full scale
    particles::Exposure exposureAt(double frame) const;               ///< need not be whole
    environment::PlateView viewOf(ConstImageViewF plate, FrameNumber frame) const;
    /// Extinction of the air near the scene's lamps [1/m]: the fog's, or the mean of the undrawn rain's over 100 m.
    double extinctionAround(const particles::Exposure& exposure) const;
    /// Optical depth [1] of the fog in front of what stands at `depth_m`; infinity is the sky.
    double fogOpticalDepth(double depth_m, const particles::Exposure& exposure) const;
    /// How far the fog in front of something reaches [m]: its depth, or less where only a ground plane is known.
    double fogDepth(double depth_m) const;

    /// See DepthSource::at. plate: the whole frame at the scale, or empty.
    std::shared_ptr<const depth::Depth> depthAt(FrameNumber frame, const particles::Exposure& exposure,
                                                ConstImageViewF plate, bool isSamePlate = false);
    double lensFocal_m(const camera::Projection& projection) const;

private:
    camera::Projection frameProjectionAt(const camera::Pose& pose) const;  ///< of all of it at full scale
    particles::Exposure exposureAt(double frame, bool ofFrame) const;
    void make(unsigned parts, const PlateSamples& samples);
    void makeTransfer(const std::vector<ImageF>& samples);
    void makeLight(const std::vector<PlateSamples::Frame>& samples);

    Wanted wanted_;
    KeptFiles kept_;
    double plateFps_;
    camera::Track givenTrack_;
    double scale_ = 1;
    Window region_;
};

}  // namespace virga::shot
