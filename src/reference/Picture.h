// The reference: the picture that docs/design.md, "Image formation", describes, slowly and in double precision. It
// shares with the shaders which drops exist (shaders/shared/drop_field.glsl), and the physics of src/optics and
// src/rainfall, and no other formula.
//
//   plate            graded (src/grade, pixel by pixel), blurred by direct evaluation (DepthBlur.h);
//   fog              1 - exp(-tau(d)) of each pixel's own depth, without a table; lamps' glow by the exact integral;
//   strokes          each drop sampled over the exposure, its own extent and the lens (DropSampler.h), laid over one
//                    another in order of depth (RainLayer.h);
//   their light      looked up along every pixel's own direction, from Scene::dropLight (DropLight.h).
//
// What it leaves open, because the renderer does: light and fog are those of a pixel's middle; depth is one value a
// pixel; strokes of one pixel are taken to hide each other at random, T = product of (1 - alpha), and not sample by
// sample. Splashes are not in it.
#pragma once

#include "reference/Scene.h"

namespace virga::reference {

/// Scene-linear premultiplied RGBA. beauty = rain over (fog over plate).
struct Picture {
    ImageD beauty, rain, fog, plate;
    ImageD nearestDepth, nearestMotion;  ///< see RainLayer.h
    std::size_t strokes = 0;
};

/// plate: of the projection's size, 4 channels, finite; depth: of the same size [m], +inf sky, or empty. Deterministic.
/// Throws Error(InvalidArgument) if there are too many drops (DropPaths.h).
Picture render(const Scene& scene, ConstImageViewF plate, ConstImageViewF depth);

}  // namespace virga::reference
