#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Grades pixels of a row in place: colour transfer, then darkening. Twin of common_grade.glsl. rgba: 4 x pixels.
void gradeRow(const Frame& frame, float* rgba, int pixels);

}  // namespace virga::passes::cpu
