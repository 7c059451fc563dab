// The shot's camera, from the file and the flags that say how it is to be read.
#pragma once

#include "camera/TrackFile.h"
#include "shot/Settings.h"

namespace virga::shot {

camera::TrackOptions trackOptionsOf(const Settings& settings);

/// The track that the settings name; empty if they name none. What its reader ignored or assumed is said as warnings.
/// Throws Error(Input) naming the file and the line.
camera::Track readCameraTrack(const Settings& settings);

}  // namespace virga::shot
