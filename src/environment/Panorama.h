// The light that surrounds the scene, as an equirectangular picture: brought by the user, or made from the plate.
#pragma once

#include <cstddef>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/Image.h"
#include "environment/PanoramaLayout.h"

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
    std::size_t transparent = 0;    ///< pixels without coverage, filled from their row
    bool black = false;             ///< no pixel gives light
    float brightest = 0;            ///< largest value of a channel
    std::vector<std::string> said;  ///< one sentence for everything that a user should know
};

struct PrepareOptions {
    PanoramaLayout layout = PanoramaLayout::Auto;
};

/// Checks and repairs a picture of 1 channel (grey), 2 (grey, then ignored), 3 (RGB), 4 (RGB, premultiplied, and alpha;
/// one that is 0 everywhere is none) or more (RGB, then ignored), and makes a full sphere of other layouts
/// (environment/PanoramaLayout.h).
/// 2:1 within 5 % is a full sphere. Wider is a band of 360 degrees around the horizon, filled up and down from its edge
/// rows. One pixel is a uniform sphere. Cube maps are known by their seams.
/// Throws Error(Input) for what is none of these (a light probe, which is round in a square: options.layout says which,
/// a plain photograph), for a picture with no finite pixel, for an empty one, and for one that does not have the shape
/// of options.layout. `name` is what errors and sentences call it.
Panorama preparePanorama(ConstImageViewF image, const std::string& name, PanoramaReport* report = nullptr,
                         const PrepareOptions& options = {});

/// The panorama with what looked along v looking along worldFromOld v. Bilinear, each pixel the mean of four places, so
/// that lights keep their energy.
Panorama turned(const Panorama& panorama, const glm::dmat3& worldFromOld);

/// One picture of the scene and where the camera looked when it was taken.
struct PlateView {
    ConstImageViewF plate;       ///< premultiplied scene-linear RGB or RGBA; transparent, NaN and infinite pixels do
                                 ///< not count
    double horizontalFov;        ///< [rad], in (0, 170 degrees]
    glm::dmat3 worldFromCamera;  ///< rotation; columns are the camera's x (right), y (up), z (back) axes
};

struct PlatePanoramaOptions {
    int width = 128;  ///< pixels around, >= 16; half as many rows
    /// Radiance of the sky far above the frames, in the plate's units; grey. Without it the sky is estimated, see
    /// below.
    std::optional<double> skyRadiance = std::nullopt;
    /// The plate's own pixels where it is seen, not their averages over 1/48 of the frame; the fill stays smooth.
    bool detail = false;
    /// Even out how frames that overlap are exposed; else they are taken as they are.
    bool evenExposures = false;
};

/// A whole sphere from what few pictures show of it: Wang et al. 2006, 4.1, "filled in the missing parts using the
/// nearest available colors", done so that it has neither seams nor streaks and moves smoothly with the camera.
///
/// In a frame: the plate, averaged to 48 columns. Around it: the nearest colours of the frame, ever more blurred,
/// that give way over 60 degrees to a profile of the plates' colours over elevation; below the frames their lowest
/// colours. Above: from the frames' highest colours T to the sky S over 30 degrees of elevation, where
///
///   S = T + max(0, G - T) in luminance; what is added is grey;   G = daylight * min(ground / 0.09, 4).
///
/// Under an overcast sky of radiance L a level grey card of reflectance 0.18 returns 0.18 L, so the mean luminance of
/// the plates' lower half tells the sky's even when no sky is in the frame. 0.09, because streets are darker than the
/// card and see no more than half of the sky; beside panoramas of an overcast square and of a wood, looked at through
/// 60 degrees and exposed for a median of 0.18, that puts the sky right within a factor of 2, most often 1.5.
/// `daylight` goes from 0 to 1 as the geometric mean luminance goes from 0.01 to 0.06, so night keeps its dark sky, and
/// as the contrast (standard deviation over mean) goes from 0.05 to 0.25, so a plate without a scene in it keeps its
/// colour. Parts of the plate that are cut off at white count half as bright again, above the horizon as bright as G or
/// skyRadiance if that is more. No term is a threshold: all of them are smooth in the plate and in the camera.
///
/// Where frames overlap each counts less towards its edge, and what only a minority shows (people, cars, drops) is
/// voted out: a weighted median, then the mean of what is near it.
///
/// Exposures are taken as they are; environment/Registration.h evens them out. Does not depend on the number of
/// threads. Throws Error(InvalidArgument) for no view, an empty plate or a field of view out of range.
Panorama panoramaFromViews(std::span<const PlateView> views, const PlatePanoramaOptions& options = {});

/// The case of one view.
Panorama panoramaFromPlate(ConstImageViewF plate, double horizontalFov, const glm::dmat3& worldFromCamera,
                           const PlatePanoramaOptions& options = {});

}  // namespace virga::environment
