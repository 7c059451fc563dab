// The camera that a renderer leaves in the header of its pictures, as OpenEXR's standard attributes say it
// (https://openexr.com/en/latest/StandardAttributes.html): row vectors, p' = p M, 16 numbers row by row.
//
// worldToCamera leads into axes with x right, y up and z ahead, which are left-handed; so from a right-handed world it
// mirrors. Renderers whose camera looks down -z write a matrix that does not mirror; which it is, its determinant
// tells. worldToNDC leads onto the picture, (0, 0) its upper left and (1, 1) its lower right corner; some write -1..1
// with y up instead, which is told by where y grows. The world is taken to be right-handed.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "camera/Camera.h"

namespace virga::camera {

using RowMatrix = std::array<double, 16>;

struct RenderMatrices {
    std::optional<RowMatrix> worldToCamera, worldToNdc;
    bool empty() const { return !worldToCamera && !worldToNdc; }
};

/// The pose by worldToCamera, else by worldToNDC; the vertical field of view by worldToNDC, if it is there. In the
/// file's own units and world. Either may lead to Error(Input), whose sentence begins with `place`: not finite,
/// singular, no rotation, orthographic, or of a left-handed world. At least one must be there.
Pose poseFromRenderMatrices(const RenderMatrices& matrices, const std::string& place);

}  // namespace virga::camera
