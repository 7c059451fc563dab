#pragma once

#include "particles/RainField.h"
#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// The drops of cells [first, last) that are seen, appended to `list` as strokes. Twin of pass_emit_strokes.comp: the
/// same drops (drop_field.glsl itself, eight at a time), and strokes that differ by float's rounding.
void emitStrokes(const Frame& frame, const particles::CellList& cells, std::size_t first, std::size_t last,
                 StrokeList& list);

}  // namespace virga::passes::cpu
