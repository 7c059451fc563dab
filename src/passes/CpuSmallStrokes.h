#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Whether splatSmallStrokes() draws the stroke: steep, in focus, a few pixels wide and a few dozen long, its matte not
/// resolved, all of it between the picture's sides. Nearly every stroke of a heavy rain is.
bool isSmall(const Frame& frame, const shared::Stroke& stroke);

/// Pixels beyond a row's end, and so beyond the band's sums, to which a small stroke may add nothing.
constexpr std::size_t smallStrokeReach = 8;

/// As splatStrokes() does, eight strokes at a time, for frames without lamps and without the nearest stroke's depth.
/// Within a step of a sum of it: logarithms round otherwise.
void splatSmallStrokes(const Frame& frame, const StrokeList& list, std::size_t bandNumber, BandSums& band);

}  // namespace virga::passes::cpu
