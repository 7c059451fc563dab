// The scene behind rain, to a first approximation.
#pragma once

#include <span>

#include "core/Image.h"

namespace virga::matte {

/// Per value, the median over frames of one size; the mean of the middle two of an even number. Frames are finite.
ImageF temporalMedian(std::span<const ImageF> frames);

}  // namespace virga::matte
