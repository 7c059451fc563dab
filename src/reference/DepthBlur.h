// The blur that many raindrops in front of a thing put over it, by its definition.
#pragma once

#include "reference/Scene.h"

namespace virga::reference {

/// Standard deviation of the blur [px] of what stands at `depth_m`: `most` at infinity, 63 % of it at `distance_m`.
double blurSigma(double depth_m, double most, double distance_m);

/// image (4 channels) convolved with a Gaussian whose standard deviation grows with depth, in two dimensions at once,
/// out to five deviations. A pixel counts with the smaller of its own sigma and that of the pixel it is blurred into,
/// and for as little as its own light is spread wider, (smaller / own)^2: on either side of a depth edge what is sharp
/// neither bleeds nor is bled over. Beyond the picture nothing counts. depth: empty, everything is at infinity.
ImageD depthBlur(const ImageD& image, ConstImageViewF depth, double most, double distance_m);

}  // namespace virga::reference
