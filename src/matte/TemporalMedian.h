// The scene behind rain, to a first approximation.
#pragma once

#include <span>

#include "core/Image.h"

namespace virga::matte {

/// Per value, the median over frames of one size; the mean of the middle two of an even number. Frames are finite.
ImageF temporalMedian(std::span<const ImageF> frames);

/// Per value, the mean of the shorter half: of the sorted values those n / 2 + 1 neighbours that lie closest together
/// (the start of Andrews et al. 1972, "shorth"). Where rain covers a pixel in nearly half of the frames the median lies
/// between dry and wet, and this does not. The values themselves for fewer than 3 frames.
ImageF shorterHalfMean(std::span<const ImageF> frames);

/// Per value, the mean of the lower quarter without the lowest: below the middle of what is dry, whether rain covers a
/// pixel in none or in three of four frames. The least for fewer than 8 frames.
ImageF lowerQuarterMean(std::span<const ImageF> frames);

}  // namespace virga::matte
