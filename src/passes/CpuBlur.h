#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Blurs a picture, RGBA, in place with a Gaussian that grows with depth. Twin of pass_blur.comp.
void blurPicture(const Frame& frame, ImageView<float> picture);

}  // namespace virga::passes::cpu
