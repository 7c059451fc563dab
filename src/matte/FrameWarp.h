// Frames resampled along a homography, into the reference's grid and back.
#pragma once

#include "core/Image.h"
#include "matte/Homography.h"

namespace virga::matte {

/// The frame resampled into the reference's grid, of the same size: cubic (Keys 1981, a = -1/2: Catmull-Rom), which
/// keeps detail and may overshoot at edges; exact for the identity. Where the frame does not reach it is 0, and
/// `covered` (1 channel, may be null) is 0 instead of 1. The frame reaches to its outermost pixel centres.
ImageF warpToReference(const ImageF& frame, const Homography& referenceFromFrame, ImageF* covered = nullptr);

/// The way back: a picture in the reference's grid, resampled into the frame's.
ImageF warpFromReference(const ImageF& picture, const Homography& referenceFromFrame, ImageF* covered = nullptr);

}  // namespace virga::matte
