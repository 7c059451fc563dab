#pragma once

#include <cstddef>

#include "core/Image.h"

namespace virga::shot {

/// Replaces NaN (by 0) and infinities (+: 65504, -: 0) of an RGBA picture, which blur and fog would spread over it.
/// Returns how many, for the report.
std::size_t repairPixels(ImageF& image);

}  // namespace virga::shot
