// The frame's constants, a stroke and a splash as C++ sees them: the very files that the shaders include.
#pragma once

#include <cstddef>

#include "particles/SharedShaders.h"

namespace virga::shared {
#include "shared/frame.glsl"
#include "shared/splash.glsl"

static_assert(sizeof(FrameConstants) == 2 * 64 + 15 * 16 && offsetof(FrameConstants, lut) == 2 * 64 + 14 * 16);
static_assert(sizeof(Stroke) == 48 && sizeof(Splash) == 64);
}  // namespace virga::shared
