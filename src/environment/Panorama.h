// The light that surrounds the scene, as an equirectangular picture: brought by the user, or made from the plate.
#pragma once

#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/Image.h"

namespace virga::environment {

/// Scene-linear RGB radiance of the whole sphere, 3 finite channels >= 0, in WORLD orientation: +y at the top row, the
/// centre column looks down -z, +x a quarter to the right (docs/conventions.md). As seen from the drop, which is small
/// against the scene.
struct Panorama {
    ImageF pixels;
};

/// What preparePanorama() found and did.
struct PanoramaReport {
    int width = 0, height = 0;      ///< of the picture that came in
    std::string takenFor;           ///< e.g. "a full sphere"
    std::size_t nan = 0;            ///< pixels with a NaN, filled from their row
    std::size_t infinite = 0;       ///< pixels with an infinity, filled from their row
    std::size_t negative = 0;       ///< pixels with a negative value, cut to 0
    bool black = false;             ///< no pixel gives light
    float brightest = 0;            ///< largest value of a channel
    std::vector<std::string> said;  ///< one sentence for everything that a user should know
};

/// Checks and repairs a picture of 1 channel (grey), 2 (grey, alpha), 3 or more (RGB, then ignored).
/// 2:1 within 5 % is a full sphere. Wider is a band of 360 degrees around the horizon, filled up and down from its edge
/// rows. One pixel is a uniform sphere.
/// Throws Error(Input) for anything narrower (a light probe, a cube map's cross, a plain photograph), for a picture
/// with no finite pixel and for an empty one. `name` is what errors and sentences call it.
Panorama preparePanorama(ConstImageViewF image, const std::string& name, PanoramaReport* report = nullptr);

struct PlatePanoramaOptions {
    int width = 128;  ///< pixels around, >= 16; half as many rows
    /// Radiance of the sky far above the frame, in the plate's units; grey. Without it the sky is estimated, see below.
    std::optional<double> skyRadiance = std::nullopt;
};

/// A whole sphere from the one view that the plate gives: Wang et al. 2006, 4.1, "filled in the missing parts using the
/// nearest available colors", done so that it has neither seams nor streaks and moves smoothly with the camera.
///
/// plate            premultiplied scene-linear RGB or RGBA; transparent, NaN and infinite pixels do not count
/// horizontalFov    [rad], in (0, 170 degrees]
/// worldFromCamera  rotation; columns are the camera's x (right), y (up), z (back) axes
///
/// In the frame: the plate, averaged to 48 columns. Around it: the nearest colours of the frame, ever more blurred,
/// that give way over 60 degrees to a profile of the plate's colours over elevation; below the frame its lowest
/// colours. Above: from the frame's highest colours T to the sky S over 30 degrees of elevation, where
///
///   S = T + max(0, G - T) in luminance; what is added is grey;   G = daylight * min(ground / 0.09, 4).
///
/// Under an overcast sky of radiance L a level grey card of reflectance 0.18 returns 0.18 L, so the mean luminance of
/// the plate's lower half tells the sky's even when no sky is in the frame. 0.09, because streets are darker than the
/// card and see no more than half of the sky; beside panoramas of an overcast square and of a wood, looked at through
/// 60 degrees and exposed for a median of 0.18, that puts the sky right within a factor of 2, most often 1.5.
/// `daylight` goes from 0 to 1 as the geometric mean luminance goes from 0.01 to 0.06, so night keeps its dark sky, and
/// as the contrast (standard deviation over mean) goes from 0.05 to 0.25, so a plate without a scene in it keeps its
/// colour. Parts of the plate that are cut off at white count half as bright again, above the horizon as bright as G or
/// skyRadiance if that is more. No term is a threshold: all of them are smooth in the plate and in the camera.
///
/// Throws Error(InvalidArgument) for an empty plate or a field of view out of range.
Panorama panoramaFromPlate(ConstImageViewF plate, double horizontalFov, const glm::dmat3& worldFromCamera,
                           const PlatePanoramaOptions& options = {});

}  // namespace virga::environment
