// The alternation that solves Wang et al. 2006, Eq. (1): alphas for a scene, the scene for those alphas, and again.
#pragma once

#include <span>
#include <vector>

#include "matte/RainEquation.h"

namespace virga::matte {

struct AlternationOptions {
    RainTerms terms{};
    int iterations = 20;          // at most, >= 1; an iteration is an alpha step and a scene step
    double tolerance = 0.0;       // ends earlier once F falls by less than this share of itself; 0 = never
    double stepTolerance = 1e-7;  // of the steps that iterate (RainEquation.h)
    bool findSlant = false;       // terms.slant starts at 0 and is found anew after each alpha step (RainDirection.h)
};

struct Alternation {
    ImageF scene;
    std::vector<ImageF> alphas;          // one a frame, 1 channel
    double slant = 0.0;                  // [rad] with which the last alphas were found
    std::vector<RainObjective> history;  // of the pair after each scene step
    bool rose = false;                   // F rose in a half step, beyond rounding: the loop was stopped there
};

/// Throws Error(InvalidArgument) saying what is not so: at least one frame, all of one size, 1 or 3 channels, finite;
/// trusts and costs of that size with 1 channel, one a frame or none; costs finite and not negative.
void checkFootage(const Footage& footage);

/// Starts from the temporal median. Needs a frame at least, all of one size and 1 or 3 channels, all finite, and as
/// many trusts and costs as frames or none: an Error(InvalidArgument) says what is not.
Alternation alternate(const Footage& footage, const AlternationOptions& options);

}  // namespace virga::matte
