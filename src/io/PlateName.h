// What the name of a plate means before any file is opened: a folder that holds one sequence, one frame of a sequence.
#pragma once

#include <optional>
#include <string>

#include "core/FrameRange.h"

namespace virga::io {

/// A folder becomes the sequence in it, as a pattern ("FOLDER/shot.%04d.exr"), or the one image in it; all else stays.
/// Only images count, and no file whose name begins with a dot. Throws Error(Input) listing what there is if that is
/// several sequences or nothing.
std::string resolvePlateName(const std::string& path);

/// The number of an image that is named like one frame of a sequence: digits alone, or behind '.' or '_', at the end of
/// the name before its extension ("shot.1003.exr", "b_0001.png", "0007.jpg", "s.-012.exr").
std::optional<FrameNumber> frameNumberIn(const std::string& path);

}  // namespace virga::io
