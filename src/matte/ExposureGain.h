// How the exposure of footage breathes: cameras that set themselves change it by a few per cent from frame to frame,
// more than light rain adds. Taken out before the scene is estimated, and put back into what is delivered.
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

/// The gain of each frame and channel against the common scene, [frame * channels + channel], > 0, their geometric mean
/// over the frames 1: the median over the pixels of I / S, S the temporal median of I / gain, three rounds. Within 0.5
/// % under rain on a quarter of the pixels; what moves has as little say. Black pixels have none; a black channel
/// gives 1. Frames are of one size.
std::vector<double> exposureGains(std::span<const ImageF> frames);

/// In place, a gain a channel: frame * gain, and frame / gain.
void applyGain(ImageF& frame, std::span<const double> gains);
void removeGain(ImageF& frame, std::span<const double> gains);

}  // namespace virga::matte
