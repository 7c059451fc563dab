// What a shot needs, decided before anything is allocated (docs/design.md, "Skip what the scene doesn't need").
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "passes/FrameTargets.h"
#include "shot/Settings.h"
#include "shot/Skips.h"

namespace virga::shot {

/// What is wanted besides the settings.
struct Wanted {
    bool layers = false;    ///< rain, splash, fog, plate; depth and motion of the strokes
    bool panorama = false;  ///< the light's panorama itself, besides what drops make of it
    Skips skips{};
};

/// One line of `--explain`: a pass, whether it runs, and why.
struct PlannedPass {
    std::string name;
    bool runs;
    std::string why;
};

struct FramePlan {
    passes::Features features;
    Skips skips;
    bool cameraMoves = false;  ///< the emit pass needs the camera twice
    std::vector<PlannedPass> passes;

    /// Nothing to do: plates pass through and no device is opened.
    bool isPassThrough() const { return !features.anything(); }
    /// A pass turns out to have nothing to do once its inputs are read.
    void leaveOut(std::string_view pass, const std::string& why);
};

/// cameraMoves: the track, if any, is not constant.
FramePlan planFrame(const Settings& settings, const Wanted& wanted, bool cameraMoves);

}  // namespace virga::shot
