// An atlas as strokes are drawn with it.
#pragma once

#include <vector>

#include "matte/StrokeAtlas.h"

namespace virga::passes {

/// Prefix sums scaled to end at 1, layers x (height + 1): a stroke deposits what its drop covers, whatever its matte.
std::vector<float> normalisedPrefix(const matte::StrokeAtlas& atlas);

/// Each row of each matte scaled to a mean of 1: how the row's mass is spread across. Layers x height x width.
std::vector<float> rowDensities(const matte::StrokeAtlas& atlas);

}  // namespace virga::passes
