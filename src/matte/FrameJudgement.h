// How well a picture lies where a fit says, by the picture's parts, each of which is asked on its own: a fit may be
// sure of itself and wrong.
#pragma once

#include "core/Image.h"
#include "matte/FrameRefinement.h"

namespace virga::matte::alignment {

struct Judgement {
    int textured = 0, inliers = 0;      // cells
    double share = 0, residual_px = 0;  // inliers of textured; their rms distance from their place, of level 0
};

/// Looks for what is left of the displacement in each cell of the template (Lucas and Kanade 1981, with the weights and
/// the brightness of the fit). A cell is an inlier if it is found, is alike, and lies where the fit says.
Judgement judged(const ImageF& from, const ImageF& to, const Grid& grid, int level, const Fit& fit);

}  // namespace virga::matte::alignment
