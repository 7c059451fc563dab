// The frame's constants, a stroke and a splash as C++ sees them: the very files that the shaders include.
#pragma once

#include <cstddef>

#include "particles/SharedShaders.h"

namespace virga::shared {
#include "shared/frame.glsl"
#include "shared/planes.glsl"
#include "shared/splash.glsl"

static_assert(sizeof(FrameConstants) == 2 * 64 + 17 * 16 && offsetof(FrameConstants, lut) == 2 * 64 + 16 * 16);
/// Of a stroke where there are lamps: the shader's struct has one row more.
constexpr std::size_t litStrokeBytes = sizeof(Stroke) + 16;

static_assert(sizeof(PlanesLayout) == 10 * 16);
static_assert(sizeof(Stroke) == 48 && sizeof(Splash) == 64 && sizeof(PointLight) == 32);
}  // namespace virga::shared
