// The drop field and the visibility rule as C++ sees them: the very files that the shaders include.
#pragma once

#include "shared/alias.h"

namespace virga::shared {
#include "shared/drop_field.glsl"
#include "shared/visibility.glsl"

static_assert(sizeof(Cell) == 48 && sizeof(DropClass) == 48 && sizeof(TurbulenceWave) == 32,
              "rows of 16 bytes, as std430 lays them out");
}  // namespace virga::shared
