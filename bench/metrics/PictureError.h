// How far a rendered picture is from the true one.
#pragma once

#include <vector>

#include "core/Image.h"

namespace bench {

/// In scene-linear light, over R, G and B.
struct PictureError {
    double rmse = 0;  ///< root of the mean square difference, over `mean`
    double most = 0;  ///< largest difference, over `mean`
    double flip = 0;  ///< mean FLIP (Flip.h)
};

/// Mean of R, G and B.
double meanOf(virga::ConstImageViewF picture);

/// picture, truth: of one size, 3 channels or more. mean: of the plate, > 0.
PictureError pictureError(virga::ConstImageViewF picture, virga::ConstImageViewF truth, double mean);

/// Mean power of one channel in rings of the spatial frequency: ring k holds frequencies from k to k + 1 cycles over
/// the shorter side, up to half a cycle a pixel. By Parseval's theorem the powers of all frequencies add up to the
/// variance; rings hold sums. The mean itself (frequency 0) is left out.
std::vector<double> powerSpectrum(virga::ConstImageViewF picture, int channel);

}  // namespace bench
