#pragma once

#include "core/Image.h"
#include "matte/StrokeAtlas.h"

namespace virga::shot {

/// An extraction at a glance, scene-linear RGB: the footage and its alpha above, the plate and the frame without rain
/// below, and under them the atlas, tile beside tile. Pictures are reduced to at most 640 columns; alpha is shown so
/// that its 999th permille is white.
/// atlas  null if there is none
ImageF extractSheet(ConstImageViewF frame, ConstImageViewF alpha, ConstImageViewF plate, ConstImageViewF clean,
                    const matte::StrokeAtlas* atlas);

}  // namespace virga::shot
