#pragma once

#include <optional>

#include "camera/Camera.h"
#include "environment/DropRadiance.h"
#include "shot/Settings.h"

namespace virga::shot {

/// The light that drops return, frame by frame: from the panorama of `--env`, once, or from each plate frame, so that a
/// camera that turns always has the light of what it sees.
class ShotLight {
public:
    /// Reads and prepares the panorama. Throws Error(Input) naming the file.
    explicit ShotLight(const Settings& settings);

    /// Brings the maps up to date for a frame; false if they are as they were.
    bool update(ConstImageViewF plate, const camera::Projection& projection, const camera::Pose& pose);

    /// Equirectangular maps in world axes; see environment::DropRadiance.
    ConstImageViewF radiance() const { return light_.radiance; }
    ConstImageViewF lowPassBackground() const { return light_.background; }
    int order() const { return light_.order; }

private:
    const Settings settings_;
    bool fromPlate_;
    bool baked_ = false;
    environment::DropRadianceBaker baker_;
    environment::DropRadiance light_;
};

}  // namespace virga::shot
