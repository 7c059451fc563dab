// Lamps in the scene. Twin of common_lights.glsl and of what pass_composite.comp does around lamps.
#pragma once

#include <glm/vec3.hpp>

#include "core/Lanes.h"
#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Radiance of a drop at `place` (from the camera, world axes [m]): of each lamp the share D(theta) of what arrives.
glm::vec3 lampsInDrop(const Frame& frame, const glm::vec3& place);

/// Light that the medium around all lamps scatters into eight pixels of a row, from x on, red, green, blue. Sun et al.
/// 2005. Those beyond `pixels` are not looked at.
void glowAroundLamps(const Frame& frame, int x, int y, int pixels, float (&glow)[3][lanes::count]);

}  // namespace virga::passes::cpu
