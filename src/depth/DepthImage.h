// Depth images: from what a file holds to metres along -z of the camera, one value a pixel, +inf for the sky
// (docs/conventions.md). Every pixel of the result is above 0 or +inf; there is no "unknown" left in it.
#pragma once

#include <cstdint>
#include <optional>

#include "core/Image.h"

namespace virga::depth {

struct DepthOptions {
    double scale = 1;               // metres in a stored unit, > 0: 0.001 for millimetres, 1/256 for KITTI's 16 bits
    bool invert = false;            // the file stores inverse depth: metres = scale / stored
    std::optional<double> noValue;  // stored value that means "not measured", e.g. 65535; 0 always does (but see below)
    double skyBeyond = 6e4;         // [m] from here on it is sky: renderers write 65504 (half's largest) or 1e10 there
};

/// What was found among `pixels` values, each value in one count at most; `filled` is what was repaired.
struct DepthCounts {
    std::int64_t pixels = 0;
    std::int64_t nan = 0;
    std::int64_t nonPositive = 0;  // <= 0 (inverse depth: < 0)
    std::int64_t noValue = 0;      // equal to DepthOptions::noValue
    std::int64_t infinite = 0;     // sky: +inf, beyond skyBeyond, or an inverse depth of 0
    std::int64_t filled = 0;       // nan + nonPositive + noValue: took the value of the nearest pixel that has one
};

struct Depth {
    ImageF metres;  // W x H x 1
    DepthCounts counts;
    bool resampled = false;  // by resampleDepth, because its size was not the plate's
};

/// Depth in metres from the first channel of `stored`.
/// NaN, values <= 0 and noValue are holes. A hole takes the depth of the nearest pixel that is none (Euclidean, in
/// pixels; the sky counts as a depth), because an unmeasured pixel belongs to something that is seen around it, while
/// depth 0 would hide all rain and the sky none. If all pixels are holes, all become sky.
/// Inverse depth: 0 is infinitely far, so it is sky and no hole; +inf would be depth 0 and counts as nonPositive.
/// Throws Error(InvalidArgument) if scale or skyBeyond is not above 0, Error(Input) if there is no pixel.
Depth sanitizeDepth(ConstImageViewF stored, const DepthOptions& options = {});

/// The depth at another size. Edges stay edges: where the four pixels around a place agree within `tolerance` (largest
/// over smallest depth <= 1 + tolerance), inverse depth, which is linear in the picture on any plane, is interpolated;
/// elsewhere the nearest pixel is taken, so that no depth appears between a wall and what is behind it. The same size
/// returns the depth as it is. Values must be as sanitizeDepth leaves them.
/// Throws Error(InvalidArgument) if a size is below 1.
/// guide: the plate, width x height x 3 or more, or empty. With it, a pixel at an edge takes that one of the nine
/// depths around it whose surroundings look most like it, so that edges of a smaller depth follow those of the picture.
Depth resampleDepth(Depth depth, int width, int height, ConstImageViewF guide = {}, double tolerance = 0.1);

/// Over the finite values; all +inf if there is none.
struct DepthStatistics {
    float min, median, max;   // [m]
    std::int64_t finite = 0;  // pixels that are not sky
};
DepthStatistics depthStatistics(ConstImageViewF metres);

}  // namespace virga::depth
