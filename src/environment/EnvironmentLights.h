// Bright small lights, taken out of an environment: in harmonics of low order they ring.
#pragma once

#include <vector>

#include "core/Image.h"
#include "environment/LightLobes.h"

namespace virga::environment {

struct TakenLights {
    std::vector<Light> lights;  ///< brightest first

    /// Root mean square error of drops' radiance by taking each light for round: three tenths of what its blur changes,
    /// all of that for lines. Estimated as if lights were wrong independently; parts of one light that is cut into many
    /// are not, and then it is up to 3 times as much (tests/environment/lights_test.cpp).
    double error = 0;
};

struct TakeLightsOptions {
    /// What rises over so many times the mean (the mean itself with its lights cut off so) is taken out; > 1.
    double threshold = 8;
    /// Root mean square error allowed for the shapes of the lights, over the mean radiance.
    double tolerance = 0.002;
    std::size_t most = 256;  ///< lights
};

/// Moves what rises over the threshold out of `image` (equirectangular, 3 channels, pixels as patches of one value), by
/// the luminance, colour kept: what stays and the lights' energies sum to what was.
///
/// Lights are found from above: all that rises is one light, the one whose shape makes the largest error
/// (LightLobes::blurError times its energy) is cut in two, and so on until the errors are under the tolerance. So a sun
/// becomes its pixels, and a far cluster of windows stays one light. Stays in the image: what is faint, and what is so
/// wide that harmonics do it better.
TakenLights takeLights(ImageF& image, const LightLobes& lobes, const TakeLightsOptions& options);

}  // namespace virga::environment
