// What a plate shows beyond its frame: an EXR's data window beyond its display window.
#pragma once

#include "io/FrameSource.h"

namespace virga::io {

/// Puts what was rendered around the frame into `overscan`, pixels of the file's data window, as far as it reaches.
/// `wide`: the frame in the middle.
void takeOverscan(ConstImageViewF wide, const PlateFile& file, ImageF& overscan);

}  // namespace virga::io
