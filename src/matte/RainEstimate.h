// How much rain, and through how long a shutter: from strokes that were found in footage (RainStrokes.h) back to the
// settings of `virga rain`, with ranges.
//
// The model of a stroke. A drop of diameter D falls at v(D), z away from a lens of focal length f [px], while the
// shutter is open for T. Its picture is w = D f / z wide and goes a way of L = v T f / z. Its disc, pi/4 w^2, spread
// over that way leaves the mass across
//     m = integral of alpha over u = o (pi/4) w^2 / L,                                                            (1)
// o the multiplier `virga rain --opacity`, which stands for what cameras make of rain (docs/realism.md). Defocus,
// pixels and the finder widen the stroke and leave m L as it is; c = f a |1/z - 1/z_focus| for an aperture a:
//     W^2 = (acrossShape)^2 (w^2 + c^2) + blur^2.                                                                 (2)
//
// What is identifiable, in this order:
// - o, where strokes are wide enough for (2) to tell w: o w^2 = 4 m L / pi. Too few such strokes: 5 is assumed,
//   between 2 and 12.5.
// - L / w = v T / D = sqrt(pi o L / (4 m)), whatever z. v / D hardly depends on D (4.1 /ms at 0.5 mm, 4.0 at 1, 3.2 at
//   2), so T follows, given the diameters that the rain's model expects among the strokes that can be seen. T goes with
//   the root of o.
// - the rate, from the number of strokes. N(D) of rainfall::DropSizes, integrated over the part of the view in which a
//   stroke by (1) and (2) is over the limits of contrast and length, grows with the rate. That volume goes with T^3
//   where length limits it and with o^3 where contrast does, so the rate is the least certain of the three: a factor of
//   two from footage is a good result.
// What is found scatters about (1), by 20 % in contrast: of the many strokes just under the limit some are lifted over
// it. The model counts and weighs them so. It does not know how many strokes crowding hides.
//
// Not identifiable, and assumed: the lens (focal length, aperture, focus), Marshall and Palmer's sizes (drip from eaves
// is larger), no wind along the view, a level camera. A wrong focal length scales z alone: the exposure stays, and the
// rate goes about with its inverse.
//
// Measured on rain that `virga rain` drew at 960x540 (six frames, strokes found in the layer's true alpha, 5 to 80
// mm/h, 1/500 to 1/60 s, focal length known): exposures within 11 %, but up to 31 % long at 1/500 s, where strokes are
// as short as the finder's limit, and 29 % short where rain is so dense that few strokes stand alone (25 mm/h at 1/60
// s, 80 not found at all); rates within a factor of 2 at the default opacity, 3 with wind, another lens or opacity, and
// 3 to 7 too low in that dense rain. The errors of rate, exposure and opacity make up for each other: drawn again with
// what was found, such rain shows the same number of strokes over a contrast within 20 %, their contrasts within 6 %,
// median lengths within 9 % (dense: 18 %).
#pragma once

#include <span>

#include "matte/RainStrokes.h"

namespace virga::matte {

struct RainEstimateOptions {
    double focal_px = 0;               // focal length [px]; 0: that of a horizontal field of view of 60 degrees
    double near_m = 0.8, far_m = 200;  // depths between which there is rain [m], 0 < near < far
    double aperture_m = 2.7e-3;        // diameter of the lens's opening [m], >= 0; `virga rain`'s own, about a phone's
    double focus_m = 5;                // distance in focus [m], > 0
    double fps = 0;                    // frames a second: no exposure is longer than a frame; 0 unknown
    // What findRainStrokes was asked for. Where noise hid more than minContrast says, the contrasts themselves show it:
    // what counts is 1.25 times their first decile, if that is more than 1.25 minContrast.
    double minContrast = 0.01;  // > 0
    double minLength = 6.0;     // [px], > 0
    double maxWidth = 10.0;     // [px], > 0
    double blur_px = 1.3;       // the width that a stroke of no width has in the footage, as found [px], > 0
};

/// Ranges are meant to hold nine times in ten; low <= value <= high, all finite.
struct RainEstimate {
    bool found = false;  // else everything is 0
    double rate_mm_h = 0, rateLow = 0, rateHigh = 0;
    double exposure_s = 0, exposureLow = 0, exposureHigh = 0;
    double opacity = 0, opacityLow = 0, opacityHigh = 0;  // a multiplier: `virga rain --opacity`
    bool opacityMeasured = false;                         // else it is the assumed 5
    double wind_m_s = 0;  // across the picture, to the right positive: median fall speed times the tangent of the slant
    double diameter_m = 0;  // median of the drops that show, as the model has it
    double density = 0;     // strokes a frame a megapixel that count
    int counted = 0;        // whole strokes that the estimate rests on
};

/// Only strokes whole inside the picture count, each for the area in which it could have lain; medians are over the
/// better half of them by score. Strokes with a size, alpha or slant that nothing real has count as none.
/// Not found: fewer than 8 strokes that count; strokes less than 3.5 times as long as they are wide in the median,
/// which are snow or a shutter so short that rain has no length; more strokes than 1000 mm/h would make. Wind beyond a
/// slant of 1.3 rad is that of 1.3. Throws Error(InvalidArgument) naming an option out of range, Error(Internal) for
/// sizes or frames under 1.
RainEstimate estimateRain(std::span<const RainStroke> strokes, int width, int height, int frames,
                          const RainEstimateOptions& options);

}  // namespace virga::matte
