// The colour C of rain that is seen over a known scene, from the strokes alone.
#pragma once

#include <array>

#include "matte/RainEquation.h"

namespace virga::matte {

struct RainColor {
    std::array<float, 3> color = {};  // C, in the units of the footage; further channels as the first if it has one
    double error = 0.0;               // standard error of the channels' mean for this scene
    bool found = false;               // there were strokes enough (200 samples) over a scene that is not even
};

/// Along a stroke that crosses from S_p to S_q, r = I - S is alpha (C - S), so r_p (C - S_q) = r_q (C - S_p) wherever
/// alpha is the same. It is not, sample by sample, but neither end has more of it than the other: the sum over all
/// pairs of (r_p (C - S_q) - r_q (C - S_p)) (S_p - S_q) vanishes in the mean, whatever alpha and the noise do, and is
/// linear in C. (An instrument, as in statistics: a fit of r against S would take noise for slope.) Pairs are 1 and 2
/// pixels along the rain; which of them are wet is asked of the sample between, whose noise is its own. What one
/// channel is to the mean of all comes from the strong samples' own colours, so that a single number is left to find.
/// Where the scene has hues, and the footage keeps them in its strokes, these say far more (StrokeHue.h); both count by
/// how sure they are, and pairs alone where the two contradict each other. Solved in turn with the scene: within 0.035
/// on 20 frames of 96 x 96 with a noise of 2/255 and a C of 0.8 (tests/extract). Most of that is the scene's own bias,
/// which `error` knows nothing of. On rain that was added to footage, which has no C, the result lies beyond white: ask
/// that and `error` before it is used. Pairs are looked for in so many frames as have 2.5 million pixels, at least 6,
/// evenly spread; the scene that they are held against is the mean of what is dry in all.
///
///   scene       S, solved
///   slant       as in RainTerms
///   sigma       noise of a value
///   guess       of C's channels' mean; where the scene is more than four times as bright there is a lamp, and left out
///   selections  of the pairs, each with the C that the last one gave, >= 1: one is enough where the guess is near
RainColor rainColor(const Footage& footage, const ImageF& scene, double slant, double sigma, double guess = 1.0,
                    int selections = 3);

}  // namespace virga::matte
