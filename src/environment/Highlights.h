// Light that a picture could not hold. An 8-bit panorama ends at white; the sun, a lamp, a bright sky are cut off
// there, and with them most of what a drop would return. What is cut off is found, and put back as well as can be told.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/Image.h"
#include "environment/Panorama.h"

namespace virga::environment {

struct HighlightOptions {
    /// Radiance of the lights, in the panorama's units, as far as the user knows it. Without it: estimated.
    std::optional<double> lightRadiance = std::nullopt;
    /// The picture comes from a file of integers, or from a camera's frames: white is 1 and nothing goes beyond it.
    /// False: it is true high dynamic range and taken at its word, unless lightRadiance is given.
    bool endsAtWhite = true;
};

struct HighlightReport {
    std::size_t clipped = 0;              ///< pixels with a channel at white
    double white = 0;                     ///< the level that they are cut off at
    double share = 0;                     ///< of the sphere (or frame) that is cut off
    int lights = 0;                       ///< compact regions that were taken for lights
    std::optional<double> lightRadiance;  ///< that the lights were given: the user's, or the estimate
    bool isEstimate = false;
    std::vector<std::string> said;  ///< one sentence for everything that a user should know
};

/// Repairs a panorama in place. Of what is cut off,
///
/// * bright sky, cloud and wall get 1.5 times white, rising from their edge. In seven panoramas of high dynamic range,
///   exposed as a photograph is (a geometric mean of 0.18), the median of what is beyond white is 1.07 to 4.3;
/// * compact regions (to 0.03 sr; the sun has 7e-5) with all channels at white and something darker around them are
///   lights, unless they are well below the horizon. They get lightRadiance, in the colour of their surroundings half
///   way to grey. Where there are more than three, or none, so that the light is somewhere inside a white sky, the
///   pixels deepest inside get it, as many as the ground asks for and at least the sun's size.
///
/// Without lightRadiance the ground is asked, as panoramaFromPlate() asks it for the sky: under a hemisphere that
/// brings the irradiance E it has a mean radiance of about 0.15 E / pi (0.05 to 0.19 in those seven; docs/env.md). What
/// is missing of E is spread over the lights and the inside of the largest white region, each pixel the same.
///
/// A picture that is cut off over more than 60 % of the sphere stays as it is, and that is said; so does a uniform one.
/// name  what sentences call the picture
HighlightReport repairHighlights(Panorama& panorama, const std::string& name, const HighlightOptions& options = {});

/// Gives lightRadiance to the compact regions (to 2 % of the frame) of a plate that are cut off. 3 or more channels,
/// the first 3 count.
HighlightReport repairPlateHighlights(ImageView<float> plate, double lightRadiance);

}  // namespace virga::environment
