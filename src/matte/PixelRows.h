// Rows of pixels between one number a pixel and one a channel, for loops that run over values. 1 or 3 channels.
#pragma once

#include <cstddef>

namespace virga::matte {

/// Each of `width` numbers once for each channel.
void repeatRow(const float* row, int width, int channels, float* to);

/// (values - from), the mean of the channels, of `width` pixels.
void meanDifference(const float* values, const float* from, int channels, std::size_t width, float* to);

}  // namespace virga::matte
