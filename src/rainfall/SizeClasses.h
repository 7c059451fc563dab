// The drop sizes cut into classes that each fall at one speed. In the frame that falls with it, a class is then a
// static field of drops (docs/design.md, "Which drops exist"), so any frame can be made alone.
#pragma once

#include <vector>

#include "rainfall/DropSizes.h"

namespace virga::rainfall {

/// The drops of diameters [d0, d1], all of them falling at `speed`.
struct SizeClass {
    double d0, d1;           ///< [m]
    double numberPerVolume;  ///< drops [1/m^3]
    double speed;            ///< [m/s]; mean over the class's water, so the class brings the rain that its drops bring
    double speedError;       ///< [m/s]; the most by which a drop of the class should fall faster or slower than `speed`
    double meanDiameter;     ///< mean of D [m]
    double meanSquare;       ///< mean of D^2 [m^2]; pi/4 of it is the mean shadow
    double meanCube;         ///< mean of D^3 [m^3]; pi/6 of it is the mean volume
    double weight;           ///< share of all visible strokes that the class holds; sums to 1 over the classes
};

/// What "visible" means for the cut. A drop narrower than a pixel shows, at distance z, with a peak opacity of
///   (D / (v T)) (D f / z)          [fraction of the shutter over a pixel] x [fraction of the pixel covered]
/// for exposure T and focal length f in pixels, so strokes stay over contrast c out to
///   z(D) = D^2 / v(D) * sight,     sight = f / (T c),
/// and a frustum holds N(D) z(D)^3 of them per metre of diameter, up to `farthest`.
///
/// The classes belong to the rain and not to the shot: keep the defaults (1500 pixels, 1/48 s, 1/255, 60 m) whatever
/// the camera does, or drops change places when a lens is animated.
struct SizeClassOptions {
    int count = 32;                  ///< 1 to 256
    double smallestDiameter = 3e-4;  ///< [m]; smaller drops are never seen singly
    double sight = 1.8e7;            ///< f / (T c) [pixels/s]
    double farthest = 60.0;          ///< [m]
};

/// Cuts [smallestDiameter, sizes.largestDiameter()] into `count` classes of ascending size. Two thirds of the cutting
/// measure are visible strokes as above, one third is fall speed: the classes hold about equally many strokes, and none
/// spans more than 3/count of the whole range of speeds. 32 classes from 1 to 200 mm/h: speedError is at most 0.54 m/s
/// (the smallest drops) and 0.12 m/s rms over the strokes. The number, area and water of the classes add up to those of
/// `sizes` over that interval.
/// No classes for a rate of 0. Throws Error(InvalidArgument) if an option is out of range.
std::vector<SizeClass> makeSizeClasses(const DropSizes& sizes, const SizeClassOptions& options = {});

}  // namespace virga::rainfall
