// The airlight of a pixel as C++ sees it: the very file that the shaders include, airlightQuadrature() of it.
#pragma once

#include "shared/alias.h"

namespace virga::shared {
#include "shared/airlight.glsl"
}  // namespace virga::shared
