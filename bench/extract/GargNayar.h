// A baseline to measure against, not part of the product: Garg & Nayar, "Detection and removal of rain from videos",
// CVPR 2004, section 5, written from the paper. A drop is in a pixel for one frame, brightens it by an amount that is
// linear in the background (a small negative slope), and rain has one direction over many frames.
//
// What the paper leaves open, and what is chosen here:
//   equality of I_n - I_{n-1} and I_n - I_{n+1}   to within `equality`; not asked for unless that is set
//   a streak                                      an 8-connected component of the candidates of a frame
//   the slope's range, when a fit is uncertain    a streak is rejected only where the slope is outside 0..0.039 by more
//                                                 than `slopeErrors` standard errors; taken strictly, noise alone would
//                                                 reject most streaks: they are small, and 0.039 is next to nothing
//   the 30 frames                                 centred on the frame, moved inside the clip at its ends
//   directional correlation                       see GargNayarOptions::directional
//   colour                                        detection in the mean of the channels, removal in each
//   the first and the last frame                  the two frames next to them stand for both neighbours
#pragma once

#include <vector>

#include "core/Image.h"

namespace virga::bench {

struct GargNayarOptions {
    double c = 3;             ///< least change of a streak pixel, of 255 levels
    double equality = 255;    ///< most by which the two changes differ, of 255 levels
    double maxSlope = 0.039;  ///< beta in dI = -beta I_b + alpha, from the paper's longest time in a pixel
    double slopeErrors = 2;   ///< see above
    bool photometric = true;  ///< false: no constraint on the slope, candidates are streaks
    int window = 9;           ///< width and height of the neighbourhood in which the binary field is correlated [px]
    int frames = 30;          ///< in which it is correlated
    int lineLength = 9;       ///< along which it is correlated with itself [px], odd
    /// A pixel stays where the field correlates with itself along the best direction by this much more than on average
    /// over all directions. Correlations are zero-mean over the neighbourhood, 1 where every streak goes on to the ends
    /// of the line. 0: no such test.
    double directional = 0.03;
};

/// Display-referred frames, white 1, of one size and at least three. Each pixel where rain is found becomes the mean of
/// the frames before and after.
std::vector<ImageF> gargNayar(const std::vector<ImageF>& frames, const GargNayarOptions& options = {});

}  // namespace virga::bench
