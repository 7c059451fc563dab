// The colour C of rain from the hue of strokes, where what is behind them has more than one.
#pragma once

#include <array>

#include "matte/StrokeResidual.h"

namespace virga::matte {

/// C = offset + slope * (mean of C), channel by channel.
struct ChannelLinks {
    std::array<double, 3> offset{}, slope{};
    int samples = 0;
};

/// The mean of C's channels, as one kind of evidence has it.
struct ColorEvidence {
    double mean = 0, error = 0;  // error: standard error
    bool found = false;
};

/// In a sample of a stroke r = I - S is alpha (C - S) in every channel, so with m for the channels' mean
///     r_j (C_m - S_m) = r_m (C_j - S_j),   C_j = offset_j + slope_j C_m,
/// whatever alpha is: linear in C_m, one equation a sample and channel. It says something where S has a hue of its own,
/// which shows through: the less the more light the drop returns. Each is weighted with offset_j - S_j + slope_j S_m,
/// that hue, which knows nothing of the sample's noise; what the noise of S adds to both is taken out. Nothing is asked
/// of how alpha goes along a stroke, so that a few short strokes are enough: with 7 % of 20 frames of 160x120 wet and
/// no noise C is found to 1e-3 over a picture of saturation 0.5, with a noise of 1/255 to 0.012, where pairs along the
/// strokes are off by 0.4 (tests/matte/rain_color_test.cpp).
///
/// Colours that were stored at half the resolution, or that a codec has smoothed, are too weak in narrow strokes, as if
/// light had been added: then the hue's second difference across a stroke is less than that of the light by more than a
/// third, and nothing is said.
///
///   wet    limits of the channels' mean (StrokeResidual::wet); the samples before and behind along the rain decide
///   slant  as in RainTerms
///   sigma  noise of a value
ColorEvidence colorFromHue(const StrokeResidual& residual, const ChannelLinks& links, const ImageF& wet, double slant,
                           double sigma);

}  // namespace virga::matte
