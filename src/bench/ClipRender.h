// One frame of a clip through the renderer, or through the reference.
#pragma once

#include <string>

#include "bench/Clip.h"
#include "shot/ReferenceRenderer.h"

namespace virga::bench {

struct Measured {
    ImageF beauty;
    ImageF effect;       ///< what rain and fog change, beauty - the graded plate
    double ms = 0;       ///< of rendering the frame
    int lightOrder = 0;  ///< that --env-order auto chose, or was given
};

/// A layer of a frame; black and clear where it has none of that name.
ImageF layerOf(const io::RenderedFrame& frame, const std::string& name);

/// Needs the layers.
Measured measuredOf(const io::RenderedFrame& frame);

/// By the processor; ms: the median of five frames after the first. Throws Error.
Measured renderClip(const Clip& clip, const shot::Settings& settings);

/// By the reference. Throws Error, for too many drops too.
Measured renderTruth(const Clip& clip, const shot::Settings& settings, const shot::ReferenceOptions& options);

}  // namespace virga::bench
