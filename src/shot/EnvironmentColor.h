#pragma once

#include <array>

#include "core/Image.h"

namespace virga::shot {

/// The light that a drop returns in front of a plate, scene-linear: the mean over the view of what the plate's own
/// surroundings, guessed from it (environment/Panorama.h), bring to a drop. 8-bit plates cut their skies off: about
/// half of what filmed rain shows. plate  scene-linear, 1 or 3 channels;  horizontalFov  [rad]
std::array<double, 3> environmentColor(const ImageF& plate, double horizontalFov);

}  // namespace virga::shot
