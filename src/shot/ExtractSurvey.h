// What a clip is asked before it is solved: in which values the model holds, and whether the camera stands.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "shot/ExtractJob.h"
#include "shot/ModelSpace.h"

namespace virga::shot {

struct SpaceChoice {
    ModelSpace space = ModelSpace::Linear;
    std::optional<double> linear, display;  ///< unevenness of the noise in either, where it was asked (ModelSpace.h)
    std::string why;
};

/// The one that the user names, else the one in which the noise is the more even, else as the file is.
SpaceChoice chooseSpace(const ExtractJobOptions& job, bool isFloat, std::span<const ImageF> linearFrames);

struct CameraJudgement {
    double motion_px = 0;  ///< the largest displacement of a corner between three frames, first, middle and last
    bool moves = false;    ///< more than registration is uncertain by
    bool isLost = false;   ///< one of the three cannot be registered: a cut, or nothing to hold on to
};

/// From frames in linear light; of fewer than three nothing is said.
CameraJudgement judgeCamera(std::span<const ImageF> linearFrames);

}  // namespace virga::shot
