// Depth images: from what a file holds to metres along -z of the camera, one value a pixel, +inf for the sky
// (docs/conventions.md). Every pixel of the result is above 0 or +inf; there is no "unknown" left in it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/Image.h"

namespace virga::depth {

/// What the stored values are.
enum class DepthKind {
    Z,          ///< metres along the camera's axis = scale * stored + offset
    Distance,   ///< the same along the ray: z = distance * f / hypot(f, x, y), the place from the picture's middle
    Inverse,    ///< metres = scale / (stored + offset)
    Disparity,  ///< of a stereo pair [px of the depth image]: metres = baseline * focal / (scale * stored + offset)
};

struct DepthOptions {
    DepthKind kind = DepthKind::Z;
    double scale = 1;   // > 0: 0.001 for millimetres, 1/256 for KITTI's 16 bits
    double offset = 0;  // see DepthKind
    // Depth [m] where the stored value is 0 and where it is `full`, both > 0, instead of scale and offset; depth goes
    // straight in between, or its inverse does if the kind is Inverse.
    std::optional<std::array<double, 2>> range;
    double full = 1;                // the largest stored value of the file's type
    double baseline_m = 0;          // of Disparity, > 0
    double focal_px = 0;            // of the depth image, > 0: of Disparity and Distance
    std::optional<double> noValue;  // stored value that means "not measured", e.g. 65535; 0 always does (but see below)
    double skyBeyond = 6e4;         // [m] from here on it is sky
    // A stored depth or distance from here on is sky, whatever its unit: renderers write half's largest, 65504, or
    // 1e10.
    double skyStored = std::numeric_limits<double>::infinity();
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
/// Throws Error(InvalidArgument) if a number is not as DepthOptions says, Error(Input) if there is no pixel.
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
