#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/FrameRange.h"
#include "core/KeptFiles.h"
#include "environment/DropRadiance.h"
#include "shot/LightKeyFrames.h"
#include "shot/PicturesInMemory.h"
#include "shot/Settings.h"

namespace virga::shot {

/// The light that drops return, frame by frame:
///
///   --env pano.exr         one panorama, once;
///   --env pano.####.exr    a panorama every few frames, blended between them: for cameras that travel;
///   no --env               from a few frames of the plate, once (`views`); without these from each frame by itself,
///                          so that light that changes and cameras that nobody tracked have the light of what they see.
class ShotLight {
public:
    /// views  frames of the plate and where they look; may be empty. Needed no longer than this.
    /// Reads and prepares the panorama, if it is one. Throws Error(Input) naming the file.
    /// keepsPanorama  for panorama()
    /// kept           panoramas' light of earlier runs (KeptLight.h)
    /// inMemory       holds the panorama if settings.env names one in it
    ShotLight(const Settings& settings, std::span<const environment::PlateView> views, bool keepsPanorama = false,
              const KeptFiles& kept = {}, std::shared_ptr<const PicturesInMemory> inMemory = nullptr);

    ShotLight(const ShotLight&) = delete;
    ShotLight& operator=(const ShotLight&) = delete;

    /// Whether update() looks at the frame's plate.
    bool needsPlate() const { return isEachFrame_; }
    /// Brings the maps up to date for a frame that looks as `view` says; false if they are as they were. The view's
    /// plate may be empty unless needsPlate(). isSamePlate: the view's pixels are those of the call before.
    bool update(FrameNumber frame, const environment::PlateView& view, bool isSamePlate = false);

    /// Equirectangular maps; see environment::DropRadiance.
    ConstImageViewF radiance() const { return light_.radiance; }
    ConstImageViewF lowPassBackground() const { return light_.background; }
    int order() const { return light_.order; }
    double remainder() const { return light_.remainder; }            ///< what the order leaves out, rms over the mean
    std::size_t lightCount() const { return light_.lights.size(); }  ///< small lights shaded one by one

    /// What the maps were made of, in their axes and --env-gain in it. Needs keepsPanorama; not with a sequence of
    /// panoramas, which has none between its frames.
    const environment::Panorama& panorama() const { return panorama_; }

    /// The maps' axes: their direction of a direction in the world. A panorama turned by --env-yaw and --env-pitch.
    const glm::dmat3& environmentFromWorld() const { return environmentFromWorld_; }

private:
    const environment::DropRadianceBaker& baker();
    environment::DropRadiance fromFile(const std::string& path);
    environment::DropRadiance fromViews(std::span<const environment::PlateView> views);
    environment::DropRadiance keptFromViews(std::span<const environment::PlateView> views);
    void keep(environment::Panorama panorama);

    const Settings settings_;
    const environment::DropRadianceOptions options_;
    std::optional<environment::DropRadianceBaker> madeBaker_;  // when one is needed: that takes 0.1 s with lights
    const KeptFiles kept_;
    const std::shared_ptr<const PicturesInMemory> inMemory_;
    glm::dmat3 environmentFromWorld_{1.0};
    std::optional<LightKeyFrames> keyFrames_;
    bool isEachFrame_ = false;
    const bool keepsPanorama_;
    environment::Panorama panorama_;
    bool isShown_ = false;  // update() has been called
    double lastFov_ = 0;    // of the view that isEachFrame_ saw last
    glm::dmat3 lastWorldFromCamera_{0.0};
    environment::DropRadiance light_;
};

}  // namespace virga::shot
