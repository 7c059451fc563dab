// Rain out of a few seconds of footage: the scene behind it, its alphas, its colour and direction.
//
// Wang et al. 2006 solve their Eq. (1) (RainEquation.h) by alternation from the temporal median; `paper` is that. It is
// ill-posed, drifts, and takes whatever moves for rain. Ours keeps the equation and changes what is asked of it:
//
//   start       what is dry (DryScene.h): the median is too bright where rain covers a pixel in half of the frames
//   weights     what moves and is not rain has no say (SceneTrust.h); exposure that breathes is taken out before
//   noise       measured on the dark side of the scene, where rain is not, block by block (NoiseMap.h)
//   mu, lambda  noise variance over the variances that the slopes of rain along its strokes and of scenes have, of the
//               footage's range 0.06^2 and 0.1^2
//   cost        on alpha, linear, in units of its noise: 1.5 sigma for a speck that stands alone, next to nothing
//               where alphas along the rain speak for a stroke
//   C           from the strokes' own samples over backgrounds that differ (RainColor.h), unless it is given
//   steps       of alphas and scene: one a round, or two where the first one moves the scene by 0.3 sigma on average, as
//               few frames and dense rain do
//
// Footage times a factor gives the same alphas: nothing here knows what white is.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "matte/NoiseMap.h"
#include "matte/RainDirection.h"
#include "matte/RainEquation.h"

namespace virga::matte {

/// Where a C comes from.
enum class ColorSource {
    Given,
    Strokes,   // their own samples, to 0.3 of |C - S| or better
    Added,     // uncertain, but surely half as bright again as the footage is: light that was added to it, as by a
               // compositor, has no C, and one far beyond white serves
    Fallback,  // the strokes do not tell: ExtractionOptions::fallbackColor
};

struct ExtractionOptions {
    bool paper = false;                         // Eq. (1) alone: from the median, without bounds, cost and weights
    std::optional<std::array<float, 3>> color;  // C, in the units of the footage
    std::optional<std::array<float, 3>> fallbackColor;  // none: 1, or half as bright again as footage beyond 1
    std::optional<double> slant;                        // [rad]; none: found
    std::optional<double> lambda;                       // none: from the noise; paper: 1/20
    std::optional<double> mu;                           // none: from the noise; paper: 1/4
    int rounds = 3;                                     // of alphas, scene and what follows from them, >= 1; paper: 20
    double tolerance = 1e-4;                            // of the steps that iterate
    bool movers = true;                                 // tell apart what moves; needs 5 frames
};

struct Extraction {
    ImageF scene;                     // S, at the mean exposure
    std::vector<ImageF> alphas;       // one a frame, 1 channel
    std::vector<ImageF> trust;        // one a frame, 0..1; empty: everything is trusted
    std::vector<double> gains;        // [frame * channels + channel], taken out of the footage
    std::array<float, 3> color = {};  // C
    double colorError = 0;            // standard error of the mean of its channels; 0 if given
    ColorSource colorSource = ColorSource::Given;
    double brightestWet = 0;  // so bright is the ground that rain is seen over, the mean of the channels:
                              // the 95th percentile over what rises 4 sigma above it. C is brighter
    double range = 1;         // what is bright in the footage (DryScene.h)
    RainDirection direction;
    NoiseMap noise;
    RainTerms terms;                     // those of the last solve
    std::vector<RainObjective> history;  // F after each scene step
    bool rose = false;                   // F rose in a half step, beyond rounding: the steps were ended there
};

/// The frames, in order, from a camera that stands still; they lose their breathing exposure (divided by `gains`).
/// scene    a start for S, from frames before these; may be empty
/// covered  where each frame has a picture at all, 0 or 1, one a frame; none = everywhere
/// Throws Error(InvalidArgument) for frames that do not fit each other or are not finite (Alternation.h).
Extraction extractRain(std::vector<ImageF>& frames, const ExtractionOptions& options, const ImageF& scene = {},
                       std::span<const ImageF> covered = {});

/// Alphas of what lies below the scene as rain lies above it, for some of the frames: the same equation for 2 S - I.
/// There is no rain there, so what looks like strokes in them is what noise and things that move look like.
std::vector<ImageF> alphasBelow(std::span<const ImageF> frames, std::span<const std::size_t> which,
                                const Extraction& extraction);

/// What is behind the rain in a frame, in place: frame - alpha (C - S) where the scene is trusted, and
/// (frame - alpha C) / (1 - alpha) where something else is before it. The frame's own noise stays. `trust` may be null.
void removeRain(ImageF& frame, const ImageF& alpha, const ImageF& scene, const ImageF* trust,
                const std::array<float, 3>& color);

/// How much alpha rests on data, 0..1: the share that the data have in what holds it, w |C - S|^2 against that and mu
/// times the neighbours along the rain. `trust` may be null.
ImageF alphaConfidence(const Extraction& extraction, const ImageF* trust);

}  // namespace virga::matte
