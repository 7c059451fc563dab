// A picture's place against a template, through the levels of their pyramids and with as many parameters as the texture
// determines; found, refined and judged.
#pragma once

#include <optional>
#include <vector>

#include "matte/FrameJudgement.h"
#include "matte/FramePyramid.h"
#include "matte/FrameRefinement.h"
#include "matte/PlaneTransform.h"

namespace virga::matte::alignment {

struct Placement {
    Fit fit;
    Judgement judgement;
};

/// A frame that others are aligned to.
struct Template {
    Pyramid pyramid;
    std::vector<std::vector<Sample>> samples;  // a level
};

/// Samples of the levels from `lowest` on.
Template templateOf(Pyramid pyramid, const Grid& grid, int lowest);

/// From a guess (frame from template, normalised) through the levels first..last of the pyramids, first >= last. Fewer
/// parameters where the texture does not determine eight of them, or where the level is too small to. Nothing where it
/// does not determine a shift either, or what it finds is no camera's.
std::optional<Placement> place(const Template& from, const Pyramid& to, const Grid& grid, const PlaneTransform& guess,
                               int first, int last);

}  // namespace virga::matte::alignment
