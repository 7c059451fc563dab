// What a ridge in an alpha is as a stroke of rain (RainStrokes.h); findRainStrokes is the only user.
#pragma once

#include <vector>

#include "matte/StrokeRidges.h"

namespace virga::matte {

/// The strokes that one of up.ridges is: none, one, or several that lie end to end. Their frame is left 0.
std::vector<RainStroke> measureRidge(const ImageF& alpha, const StrokeRidges& up, const Ridge& ridge,
                                     const RainStrokeOptions& options);

}  // namespace virga::matte
