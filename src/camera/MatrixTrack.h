// Lists of 4x4 matrices, one a frame.
//
// As text, a line a frame, all lines alike; '#' starts a comment, blanks and commas part the numbers:
//     [frame] 16 numbers                       4x4
//     frame 16 numbers vertical-fov            [deg]
//     [frame] 12 numbers                       3x4, the last row is 0 0 0 1; row by row only (KITTI's poses)
//     frame 12 numbers vertical-fov
// Without frame numbers the first line is frame 0.
//
// As JSON, a matrix being 16 numbers or four rows (columns, by the layout) of four:
//     [matrix, matrix, ...]                                    the first is frame 0
//     {"1001": matrix, "1002": matrix}
//     {"frames": [{"frame": 1001, "matrix": matrix}, ...]}     "vfov_deg" in a frame or at the top
// The last also as NeRF's transforms.json spells it: "transform_matrix", "file_path" with the frame number in it, and
// "camera_angle_y", "camera_angle_x" with "w" and "h" [rad], or "fl_y" (else "fl_x" with square pixels) and "h" [px].
#pragma once

#include "camera/TrackFile.h"

namespace virga::camera {

/// In the file's own units and world: the options' scale, up and offset are not applied. Throws Error(Input) naming
/// the line, or in JSON the frame's place in its list.
TrackReading parseMatrixText(std::string_view text, const std::string& name, const MatrixLayout& layout);
TrackReading parseMatrixJson(std::string_view text, const std::string& name, const MatrixLayout& layout);

}  // namespace virga::camera
