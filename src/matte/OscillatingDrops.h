// The built-in stroke atlas: drops that oscillate as they fall, integrated over the exposure.
//
// Silhouette: a drop of mean radius 1 seen from the side, the camera level with it. With the polar angle psi from the
// vertical and side = -1 or +1 for left and right, Rayleigh's modes as Garg & Nayar 2006 use them give
//   r(psi, t) = 1 + a_2(t) P_2(cos psi) + side a_3(t) P_3^1(cos psi),   P_3^1(x) = (3/2) (5 x^2 - 1) sqrt(1 - x^2),
// a_2: axisymmetric, oblate to prolate, about the mean axis ratio 1.03 - 0.062 D[mm]; a_3: transverse, side to side.
// Frequencies after Rayleigh 1879, optics/DropOscillation.h; f_3 / f_2 = sqrt(30 / 8) for every size.
//
// Coverage: the silhouette moves along the tile (and weaves a few per cent of a radius to the sides); the value of a
// point is the time for which it is covered, each moment weighted with the brightness of the image in the drop there.
// That image is modelled, not traced: a core whose place follows a_3 and whose width follows a_2, dark crescents that
// grow from the rim on the side to which the drop leans, and beads, where the lens that the drop is comes into focus
// once or twice an oscillation. Shapes and ranges were chosen beside the environment-lit streaks of Garg & Nayar's
// database. How bright a stroke is on the whole is not the atlas's business; each matte's `mass` says what it keeps.
#pragma once

#include <cstdint>

#include "matte/StrokeAtlas.h"

namespace virga::matte {

struct OscillatingDropOptions {
    int width = 16;                 // texels across, 4..256
    int height = 64;                // texels along, 16..1024; fewer than 5 a bead would blur the beads away
    int groups = 12;                // numbers of oscillations, half an octave apart
    int variants = 8;               // mattes a group, >= 2: the first nearly plain, the last the liveliest
    float firstBeadCycles = 0.25f;  // the groups reach to firstBeadCycles * 2^((groups - 1) / 2) = 11.3
    float liveliness = 1;           // multiplies shape and brightness changes, 0..1; 0 gives plain strokes only
};

/// groups x variants mattes (96), a pure function of its arguments; the same on any number of threads.
/// Throws Error(InvalidArgument) naming the option that is out of range.
StrokeAtlas makeOscillatingDropAtlas(std::uint32_t seed, const OscillatingDropOptions& options = {});

}  // namespace virga::matte
