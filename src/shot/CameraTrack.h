// The shot's camera: from a file and the flags that say how it is to be read, or from the headers of the plate.
#pragma once

#include <optional>

#include "camera/TrackFile.h"
#include "io/Plate.h"
#include "shot/Settings.h"

namespace virga::shot {

camera::TrackOptions trackOptionsOf(const Settings& settings);

/// Whether --camera names a file: it is neither left out nor "plate" nor "none".
bool hasCameraFile(const Settings& settings);

/// The track of --camera's file; empty if it names none. What its reader ignored or assumed is said as warnings.
/// Throws Error(Input) naming the file and the line.
camera::Track readCameraTrack(const Settings& settings);

/// The camera in the headers of an EXR plate (worldToCamera, worldToNDC; camera/RenderMatrices.h): what is asked for by
/// --camera plate, and without --camera whatever is there. Nothing if neither is so. Without attributes in the first
/// frame no other is opened. Frames whose header cannot be read or lacks them have no pose.
/// Throws Error(Input) naming the frame's file for matrices that are no camera's, and for --camera plate if there is
/// none.
std::optional<camera::TrackReading> readPlateCamera(const Settings& settings, const io::PlateInfo& plate);

/// What the shot's camera is while rendering: as readPlateCamera, said in the log, else as readCameraTrack. A fault in
/// headers that nobody asked for is a warning.
camera::Track shotTrack(const Settings& settings, const io::PlateInfo& plate);

}  // namespace virga::shot
