// Which way the rain falls in a picture, from its alphas.
#pragma once

#include <span>

#include "core/Image.h"

namespace virga::matte {

struct RainDirection {
    double slant = 0.0;      // [rad] from vertical, -pi/2..pi/2; positive = the lower end lies to the right
    double coherence = 0.0;  // 0 = no direction (noise, snow, nothing), 1 = nothing but parallel lines
};

/// The direction along which the alphas change least. Wang et al. 2006 look for the most salient line through the
/// origin of alpha's spectrum, which is off by half a degree; the structure tensor of the same spectrum,
/// sum |A(f)|^2 f f', finds it to 0.1 degrees, and is by Parseval the sum of grad alpha grad alpha' over the pixels.
/// Gradients with the 5-tap pair of Farid & Simoncelli 2004, which agree in all directions. White noise adds the same
/// to both of its axes and does not turn it. Pictures narrower than 5 pixels, or constant ones: slant 0, coherence 0.
RainDirection rainDirection(std::span<const ImageF> alphas);

}  // namespace virga::matte
