// Strokes over one another, the nearest in front, in double precision and in order.
#pragma once

#include "reference/DropPaths.h"
#include "reference/Scene.h"

namespace virga::reference {

struct RainLayer {
    ImageD rain;              ///< RGBA, premultiplied; alpha 1 - the product of (1 - alpha) of all strokes
    ImageD depth;             ///< of the nearest stroke whose alpha is over visibleInData [m]; +inf where there is none
    ImageD motion;            ///< its x, y from open to close [px]; 0 where there is none
    std::size_t strokes = 0;  ///< drops that are drawn
};

/// Fainter strokes leave no depth and no motion.
inline constexpr double visibleInData = 1.0 / 1024;

/// lit: RGB light that a drop returns at each pixel; fogLight: of the fog in front of it; both of the picture's size.
/// A stroke of alpha a, of which the fog lets the share s through, brings a (s lit + (1 - s) fogLight + lamps).
/// Drops are drawn on all cores, and the picture is the same on any number of them.
/// Throws Error(InvalidArgument) if there are too many drops (DropPaths).
RainLayer rainLayer(const Scene& scene, ConstImageViewF depth, const ImageD& lit, const ImageD& fogLight);

}  // namespace virga::reference
