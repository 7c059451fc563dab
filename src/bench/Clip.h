// What the curves are measured on: one frame of a plate, made small, with the settings that belong to it.
#pragma once

#include <string>
#include <vector>

#include "shot/ShotScene.h"

namespace virga::bench {

struct Clip {
    std::string name;
    io::PlateFrame frame;
    shot::Shot shot;
    shot::Settings settings;  ///< depth, panorama, camera; no splashes, which the reference has not
};

/// The sample street of `samples`, and clips of `footage` unless that is empty; plates averaged down to about
/// `columns`. Throws Error(Input).
std::vector<Clip> readClips(const std::string& samples, const std::string& footage, int columns);

}  // namespace virga::bench
