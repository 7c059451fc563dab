// Pictures that a caller holds in memory where a setting would name a file: depth, frame by frame, and a panorama.
#pragma once

#include <cstdint>
#include <string>

#include "core/Image.h"
#include "shot/DepthReader.h"

namespace virga::shot {

/// Handed to a shot (Shot::inMemory) and changed between its frames, on the thread that renders them. Settings name
/// what is in it as they name files, so that whatever looks at settings sees that there is one, and another one.
struct PicturesInMemory {
    /// For Settings::depth. Each frame's takes the place of the last one's.
    static constexpr const char* depthName = "the caller's depth";
    StoredDepth depth{};
    std::uint64_t depthContent = 0;  ///< another number for other values

    /// For Settings::env: the beginning of it; what follows tells the content.
    static constexpr const char* panoramaName = "the caller's panorama ";
    ImageF panorama{};         ///< scene-linear, premultiplied RGBA
    bool endsAtWhite = false;  ///< made of integers, which cut lights off
};

inline bool isPanoramaInMemory(const std::string& env) { return env.starts_with(PicturesInMemory::panoramaName); }

}  // namespace virga::shot
