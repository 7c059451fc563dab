// How different two pictures look to somebody who flips between them: Andersson, Nilsson, Akenine-Moller, Oskarsson,
// Astrom & Fairchild 2020, "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact.
// Tech. 3(2), article 15. Written from the paper; its symbols, its constants.
//
//   colour    both pictures through the eye's contrast sensitivity (one Gaussian for luminance, one for red-green, two
//             for blue-yellow, in the opponent space YCxCz), back to the display's gamut, to L*a*b* with Hunt's effect,
//             apart by HyAB, to the power 0.7, the upper 60 % of what a display can show pressed into 5 %;
//   features  edges and points of luminance, by derivatives of a Gaussian of 0.082 degrees;
//   together  colour^(1 - features), 0 to 1, for each pixel.
#pragma once

#include "core/Image.h"

namespace virga::bench {

/// Of the paper's display: 0.7 m from a screen 0.7 m wide, of 3840 pixels.
inline constexpr double flipPixelsPerDegree = 67;

/// One channel, 0 (no difference) to 1. Pictures are scene-linear, Rec.709, 3 channels or more, of one size; what a
/// display of white 1 does not show is cut off. Symmetric in its arguments.
ImageF flip(ConstImageViewF a, ConstImageViewF b, double pixelsPerDegree = flipPixelsPerDegree);

/// Its mean.
double meanFlip(ConstImageViewF a, ConstImageViewF b, double pixelsPerDegree = flipPixelsPerDegree);

}  // namespace virga::bench
