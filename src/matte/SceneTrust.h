// What in footage is not a still scene behind rain: people, cars, leaves. They get no say in the scene or in alpha
// (RainEquation.h, Footage::trust).
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

/// Standard deviation of the noise of one value, in the footage's units: 1.4826 times the median of how far values lie
/// below the scene. Rain is brighter than what it hides almost everywhere and is left out by that; noise is as strong
/// on the dark side as on the bright one. 0 where nothing is below the scene.
double noiseLevel(std::span<const ImageF> frames, const ImageF& scene, double repeated = 0.0);

/// 0 where something moves, 1 elsewhere, a picture a frame. Told from rain in the mean of the channels and in units of
/// its noise, which is measured there, by sign, breadth and staying:
///
///   darker than the scene   3 x 3 pixels' mean shortfall beyond 3 sigma (noise alone has 0.4 +- 0.2 sigma)
///   brighter, and stays     5 x 5 pixels' mean beyond 6.5 sigma, and half of that within 2 pixels in the frames before
///                           and after; rain is elsewhere by then
///
/// and what is within 2 pixels of such; but only in tiles of 32 x 32 pixels, and beside them, in which more than 0.5 %
/// of the samples are evidence that something moves: darker than the scene, as above, or part of something 4 sigma
/// brighter that is 16 x 16 pixels at least and there in the frames before and after. No such tile: no trusts at all,
/// everything is trusted. `frames` in order, without their breathing exposure (ExposureGain.h).
///
/// Not told apart: rain before something brighter than itself, which darkens it and is taken for a thing; dense rain
/// that meets itself where something else moves. Not seen: bright things that are small, or in a single frame, or
/// faster than about 6 pixels a frame.
///
///   leastNoise  noise is not taken for less; differences up to this are left out where it is measured (NoiseMap.h)
std::vector<ImageF> sceneTrust(std::span<const ImageF> frames, const ImageF& scene, double leastNoise = 0.0);

/// Whether sceneTrust finds anything.
bool somethingMoves(std::span<const ImageF> frames, const ImageF& scene, double leastNoise = 0.0);

}  // namespace virga::matte
