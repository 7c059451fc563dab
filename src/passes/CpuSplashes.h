#pragma once

#include "passes/CpuFrame.h"

namespace virga::passes::cpu {

/// Pixels along the edge of a block that asks for its splashes.
constexpr int splashBlock = 4;

/// What hits the surfaces that rows [first, last) of blocks show. Twin of pass_emit_splashes.comp.
void emitSplashes(const Frame& frame, int first, int last, SplashList& list);

/// Adds what lies in a band of the list's splashes that touch it. Twin of pass_splat_splashes.comp.
void splatSplashes(const Frame& frame, const SplashList& list, std::size_t bandNumber, BandSums& band);

}  // namespace virga::passes::cpu
