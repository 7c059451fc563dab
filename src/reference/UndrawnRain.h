// What the rain that is not drawn drop by drop does to the view.
#pragma once

#include <vector>

#include "rainfall/DropSizes.h"
#include "reference/Scene.h"

namespace virga::reference {

/// Optical depth [1] out to `depth_m` of the drops that are not drawn, by integrating their shadows (efficiency Q = 1)
/// over all sizes and all depths up to visibility.far_m:
///     integral of N(D) pi/4 D^2 (length of the part of [0, depth] in which a drop of size D is not drawn) dD.
/// A size that is drawn at all counts from its drawnDepth() on, that in front of `near` not being rain of its own. It
/// shares no quadrature with particles::RainField, and takes the sizes' law itself in the place of its classes' shares.
/// sizes: the rain's, per unit of the field's density scale. allDrops: only those under the smallest class are left.
double undrawnOpticalDepth(double depth_m, const rainfall::DropSizes& sizes, const particles::RainField& field,
                           const particles::Visibility& visibility, bool allDrops, double focal_px, double exposure_s);

/// Optical depth [1] out to each of the depths [m], ascending, that strokes which are thinned out leave to be drawn
/// otherwise:
///     integral of N(D) pi/4 D^2 (1 - thinnedShare) over the depths at which a drop of size D is drawn, dD dz.
std::vector<double> thinnedOpticalDepths(const std::vector<double>& depths_m, const rainfall::DropSizes& sizes,
                                         const particles::RainField& field, const particles::Visibility& visibility,
                                         double focal_px, double exposure_s);

}  // namespace virga::reference
