// The scene behind rain, the noise, and what else moves, as far as they can be told before any alpha is known.
#pragma once

#include <span>
#include <vector>

#include "matte/NoiseMap.h"

namespace virga::matte {

struct DryScene {
    ImageF scene;
    NoiseMap noise;             // about it
    std::vector<ImageF> trust;  // one a frame (SceneTrust.h); empty: nothing moves, everything is trusted
    bool hasMovers = false;     // something was seen to move
    double range = 1.0;         // what is bright: the 99th percentile of the scene's values, > 0
};

/// Per value the mean of what lies within -2.5 and 2 sigma of the scene, sigma the noise on its dark side, again and
/// again from the mean of the shorter half (TemporalMedian.h): it settles on the dry values even where rain covers half
/// of them, and the noise with it. Where something stands for long the scene may be its own; once it is known to move,
/// the same is done without it.
///
///   movers   look for what moves; in fewer than 5 frames what stays cannot be told from what rains, and nothing does
///   start    a scene to begin with, of frames before these; may be empty
///   covered  where each frame has a picture at all, 0 or 1, one a frame; none = everywhere. Not trusted elsewhere
///
/// The frames are at one exposure and from a camera that stands still.
DryScene dryScene(std::span<const ImageF> frames, bool movers, const ImageF& start, std::span<const ImageF> covered);

/// What moves, once more, with a better scene. Nothing that moves before, nothing now.
void renewTrust(std::span<const ImageF> frames, const ImageF& scene, std::span<const ImageF> covered, DryScene& dry);

}  // namespace virga::matte
