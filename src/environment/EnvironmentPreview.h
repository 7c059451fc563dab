// One picture that shows what an environment is, what drops keep of it, and what they return.
#pragma once

#include <string>
#include <vector>

#include "core/Image.h"
#include "environment/DropRadiance.h"
#include "environment/Panorama.h"
#include "sh/Harmonics.h"

namespace virga::environment {

/// The coefficients of a panorama of any size, its lights among the rest; pictures too small for the order are
/// enlarged.
sh::Harmonics harmonicsOf(const Panorama& panorama, int order);

/// What `baked` keeps of its panorama: its harmonics, and its lights as discs of their extent.
/// f  the transfer function's factors for R, G, B, to baked.order or beyond: the harmonics are divided by them
ImageF keptByDrops(const DropRadiance& baked, const std::vector<double> (&f)[3], int width);

/// Four panoramas with a line of text above each, equally exposed so that the panorama's mean is a middle grey:
/// `name`, order 3 of it, `baked`'s order and lights, and the radiance that a drop returns for each direction in which
/// it is seen. Scene-linear RGB, 1624 x 872.
ImageF previewSheet(const Panorama& panorama, const DropRadiance& baked, const std::string& name);

}  // namespace virga::environment
