// Frames as the alignment looks at them: one number a pixel on a range that all frames share, smoothed, and a pyramid
// of pictures of half the size each. Values that are not finite count as 0. Nothing here throws.
#pragma once

#include <vector>

#include "core/Image.h"

namespace virga::matte::alignment {

/// Brightness as one number a pixel, the reference's first to 99th percentile on 0..1, logarithmic beyond: one lamp in
/// a linear picture is not worth more than all else.
struct BrightnessRange {
    double low = 0, high = 0;
    bool empty() const { return !(high > low); }
};

/// Of a frame; empty where it has no contrast.
BrightnessRange rangeOf(const ImageF& frame);

/// A frame of 1 or 3 channels in one: what the first level of a pyramid holds. The range is not empty.
ImageF smoothedBrightness(const ImageF& frame, const BrightnessRange& range);

inline constexpr int topSide = 24;  // no level of a pyramid that has more than one has a smaller side [px]

/// Levels of half the size each; the first is the picture itself, smoothed. An empty first level: not kept.
using Pyramid = std::vector<ImageF>;

Pyramid pyramidOf(const ImageF& frame, const BrightnessRange& range);

}  // namespace virga::matte::alignment
