// How a picture shows all directions: equirectangular, as ours do, or as a cube map or a ball, which are unfolded.
//
// Cube maps are those of OpenGL and Direct3D: each face as seen from inside, right face +X, left -X, up +Y, down -Y,
// ahead +Z in their left-handed axes, which is our -z (docs/conventions.md). In a cross "ahead" is in the middle:
//
//        +Y                    +Y            horizontal strip: +X -X +Y -Y +Z -Z
//     -X +Z +X -Z           -X +Z +X         vertical strip: the same from top to bottom
//        -Y                    -Y
//                              -Z            (upside down: its top edge is -Y's bottom)
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/Image.h"

namespace virga::environment {

enum class PanoramaLayout {
    Auto,
    Uniform,          ///< one pixel
    Sphere,           ///< equirectangular, 2:1
    Band,             ///< equirectangular, 360 degrees around the horizon, wider than 2:1
    HorizontalCross,  ///< 4:3
    VerticalCross,    ///< 3:4
    HorizontalStrip,  ///< 6:1
    VerticalStrip,    ///< 1:6
    AngularMap,  ///< Debevec's light probe: a disc, the angle from its centre (ahead) grows evenly to its rim (back)
    MirrorBall,  ///< a ball of chrome filmed from far away by a camera that looks ahead, cropped to its rim
};

/// Names for the command line: "sphere, band, cross, strip, angular, mirrorball"; cross and strip by the picture's
/// shape. Nothing for a name that is none of them.
std::optional<PanoramaLayout> layoutNamed(std::string_view name, int width, int height);
inline constexpr std::string_view layoutNames = "auto, sphere, band, cross, strip, angular or mirrorball";

/// "a cube map as a horizontal cross".
std::string layoutInWords(PanoramaLayout layout);

/// The layout of an RGB picture, by shape, and by what only a cube map has: unused corners of one colour in a cross,
/// and in a strip faces that fit together at the cube's edges but not beside each other in the strip. Throws
/// Error(Input) with what the picture might be for any other.
PanoramaLayout recognisedLayout(const ImageF& image, const std::string& name);

/// Throws Error(Input) unless the picture has a layout's shape.
void requireLayout(PanoramaLayout layout, const ImageF& image, const std::string& name);

/// A cube map, a probe or a ball as a full sphere, as many pixels around as the source has (4 faces, or pi x the disc).
ImageF unfolded(const ImageF& image, PanoramaLayout layout);

}  // namespace virga::environment
