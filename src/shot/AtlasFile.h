#pragma once

#include <cstdint>
#include <string>

#include "matte/StrokeAtlas.h"

namespace virga::shot {

/// The project's own mattes: drops that oscillate as they fall. Made once a seed where KeptInMemory is.
matte::StrokeAtlas builtInAtlas(std::uint32_t seed);

/// `--mattes`: a sheet of tiles with or without its JSON beside it (FILE.exr and FILE.json), or a frame pattern with a
/// stroke an image. Throws Error(Input) naming the file.
matte::StrokeAtlas loadAtlas(const std::string& path);

}  // namespace virga::shot
