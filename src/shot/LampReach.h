#pragma once

#include <vector>

#include "particles/RainField.h"
#include "shot/LightsFile.h"

namespace virga::shot {

/// Scene-linear light that all lamps which are left out may add to a pixel together: a fifteenth of the least step of
/// 8-bit sRGB.
constexpr double unseenLampLight = 2e-5;

/// D(theta) [1/sr] of a drop for R, G, B at equal steps of theta from 0 to pi, each averaged over a step: a lamp is a
/// degree or so wide.
std::vector<float> ringTransferTable();

/// The lamps whose light can be seen in a picture, in their order; the faintest are left out as long as what they may
/// add together stays under `unseenLampLight`. A lamp of radiant intensity I that is no nearer than r to any place that
/// is in view, within `far_m`, adds at most
///     I D exp(-beta r) / r^2        to a drop there, D the greatest value of its transfer function, and
///     I exp(-beta r) / (4 pi r^2)   of airlight, as no view ray loses more than all of itself to scattering once.
/// extinction_1_m: beta, of the air. greatestTransfer_1_sr: D. dropWay_m: the farthest that a drop gets while the
/// shutter is open, seen from the camera.
std::vector<SceneLight> lampsInReach(const std::vector<SceneLight>& lamps, const particles::Exposure& exposure,
                                     double far_m, double extinction_1_m, double greatestTransfer_1_sr,
                                     double dropWay_m);

}  // namespace virga::shot
