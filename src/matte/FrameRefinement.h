// Where a picture lies against a template, on its pixels: one level of inverse compositional Gauss-Newton (Baker and
// Matthews 2004), with gain and offset of the brightness and Tukey's biweight on what remains, so that rain and what
// moves have no say. Who goes through levels and counts parameters is FramePlacement.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/Image.h"
#include "matte/PlaneTransform.h"

namespace virga::matte::alignment {

inline constexpr int parameters = 8;            // of a homography
inline constexpr double biweight = 3.0;         // standard deviations beyond which a residual has no say
inline constexpr double leastScale = 2e-3;      // of residuals, over the reference's range
inline constexpr double correlatedPixels = 12;  // 4 pi sigma^2: pixels that share their noise after a blur of sigma = 1

/// A pixel of the template.
struct Sample {
    float u, v;                            // normalised
    float value;                           // of the template
    std::array<float, parameters> change;  // of it, a parameter
};

/// The half of a level's pixels that has most gradient, thinned by a hash. None of a picture that is too small.
std::vector<Sample> samplesOf(const ImageF& picture, const Grid& grid, int level);

/// Where a picture lies: frame from template in normalised coordinates; template = gain * frame + offset.
struct Fit {
    PlaneTransform frame;
    double gain = 1, offset = 0;
    double sigma = leastScale;                                  // of the residuals, rain and movers left out
    double spread = leastScale;                                 // of all
    double loose_px = std::numeric_limits<double>::infinity();  // standard deviation at the worst corner
};

/// From a fit, at most so many steps on one level in the first `freedom` directions: 2, 4, 6, 8 are a shift,
/// similarity, affinity and homography. Nothing if the samples do not determine them.
std::optional<Fit> refined(std::span<const Sample> from, const ImageF& to, const Grid& grid, int level, Fit fit,
                           int freedom, int steps);

}  // namespace virga::matte::alignment
