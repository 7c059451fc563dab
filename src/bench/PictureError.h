// How far a rendered picture is from the true one.
#pragma once

#include "core/Image.h"

namespace virga::bench {

/// In scene-linear light, over R, G and B.
struct PictureError {
    double rmse = 0;  ///< root of the mean square difference, over `mean`
    double most = 0;  ///< largest difference, over `mean`
    double flip = 0;  ///< mean FLIP (Flip.h)
};

/// Mean of R, G and B.
double meanOf(ConstImageViewF picture);

/// picture, truth: of one size, 3 channels or more. mean: of the plate, > 0.
PictureError pictureError(ConstImageViewF picture, ConstImageViewF truth, double mean);

}  // namespace virga::bench
