#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// A matte wider than this is seen as such, as in strokes_splat.glsl [px].
constexpr float resolvedTile = 8;

/// Adds what lies in a band of the list's strokes that touch it to the band's sums. Twin of strokes_splat.glsl, in
/// integers as there, so that the order of strokes does not matter.
void splatStrokes(const Frame& frame, const StrokeList& list, std::size_t bandNumber, BandSums& band);

}  // namespace virga::passes::cpu
