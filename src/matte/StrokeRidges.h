// Where strokes of rain may be in an alpha: ridges of the upright picture (RainStrokes.h). A room of its own between
// what is filtered and what is measured; findRainStrokes is its only user.
#pragma once

#include <vector>

#include "core/Image.h"
#include "matte/RainStrokes.h"

namespace virga::matte {

/// Standard deviation of the blur along the rain [px].
inline constexpr double strokeBlur = 2.0;

/// The turned picture: u across, v along the rain, [px] from the middle of the alpha's.
struct StrokeFrame {
    double cx, cy, s, c;
    double x(double u, double v) const { return cx + u * c + v * s; }
    double y(double u, double v) const { return cy - u * s + v * c; }
};

/// A ridge's row in the upright picture.
struct RidgeRow {
    int row;
    double u;       // middle, weighted with the contrast [px of the upright picture]
    double height;  // greatest contrast
};
using Ridge = std::vector<RidgeRow>;

struct StrokeRidges {
    StrokeFrame frame;
    double u0, v0;     // of pixel (0, 0) of the upright picture
    ImageF filtered;   // the upright picture, blurred and opened along
    double sigma = 0;  // of its noise
    std::vector<Ridge> ridges;
};

/// The ridges of one alpha, ordered by row, then from left to right.
/// alpha  finite
StrokeRidges strokeRidges(const ImageF& alpha, const RainStrokeOptions& options);

/// Values at (x + i dx, y + i dy), i = 0..count - 1, linear between pixels, with bounds that repeat.
void sampleLine(const ImageF& image, double x, double y, double dx, double dy, int count, float* to);

/// Whether a point lies between the middles of the outermost pixels.
bool isWithin(const ImageF& image, double x, double y);

/// The upper one of an even number, 0 of none; puts them out of order.
double upperMedian(std::vector<double>& values);

}  // namespace virga::matte
