// Single strokes of rain in alphas: found, told from their neighbours, measured. Wang et al. 2006, section 3, rotate
// the picture upright, erode and dilate it along the rain, blur it along the rain, and choose good strokes by hand;
// here the choice is a score.
//
// Pixels: x right, y down, pixel centres at integers. Slant: [rad] from vertical, positive = the lower end lies to the
// right.
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

struct RainStrokeOptions {
    double slant = 0.0;          // of the rain [rad], -pi/2..pi/2; strokes may lie about 10 degrees off
    double noise = 0.0;          // standard deviation of alpha where there is no rain, before a bound at 0 cuts half of
                                 // it off, >= 0
    double noiseAlong = 0.0;     // how smooth that noise is along the rain: standard deviation of a Gaussian that would
                                 // make it of white noise [px], 0 = white. A solver's cost on changes along the rain
                                 // makes noise look like strokes, and only this tells them apart
    double minContrast = 0.01;   // alphas below this over their surroundings are none, whatever the noise
    double minLength = 6.0;      // [px]
    double minElongation = 2.0;  // length / width
    double maxWidth = 10.0;      // [px], 1..64; what is wider belongs to the surroundings
};

struct RainStroke {
    int frame = 0;           // index into the alphas
    double x = 0, y = 0;     // middle [px]
    double slant = 0;        // its own [rad]
    double length = 0;       // [px], between the points where alpha is half of its median along the stroke
    double width = 0;        // [px], full width at half maximum of the mean profile across
    double widthMoment = 0;  // [px], sqrt(12) standard deviations of that profile: the width of a box
    double peak = 0;        // alpha over the background: the greatest along the stroke, in the middle half of its width
    double mean = 0;        // the mean over length x width
    double contrast = 0;    // the median along the stroke
    double background = 0;  // median alpha beside the stroke
    double straightness = 0;  // 1 / (1 + (r / (width / 4))^2), r rms distance of the ridge from its line
    double isolation = 0;     // 1 - (alpha around it, 9th decile) / contrast, 0..1
    double sharpness = 0;     // steepest flank across / height [1/px], at most 1
    double reachLeft = 0;     // [px] across, from the middle to the valley before the next stroke, or to where
    double reachRight = 0;    //      nothing of the stroke is left; left is x < middle for upright strokes
    double plainness = 0;     // share of its energy that one profile along times one across explains, 0..1: what
                              // forks, bends or is speckled has less
    bool inside = false;      // whole inside the frame
    double score = 0;         // 0..1, below
};

/// All strokes, ordered by frame, then from top to bottom of the upright picture; the same for any number of threads.
///
/// Detection is on the upright picture, blurred along the rain (Gaussian, 2 px) and opened along it (5 px), less the
/// median of what lies beside. Hysteresis: a ridge counts while it is over 2.5 sigma, if it is over 5 sigma on at least
/// half of minLength rows; sigma is the noise after the blur (0.376 x noise if white), or the spread that the filtered
/// pictures themselves show if that is greater, as noise that a solver has smoothed along the rain is. Ridges side by
/// side are parted where the valley is a fifth lower than the lesser; ridges end to end at gaps (below 0.35 of the
/// lesser) and where brightness or width jumps by 1.6 and is steady on either side. Sizes are measured in the alphas
/// themselves, not in what was filtered.
///
/// score = straightness * isolation * plainness^2 * sqrt(sharpness) * min(1, length / (4 width))
///         * min(1, 1.5 contrast / peak) * snr / (snr + 4),
/// snr = contrast / sigma; 0 for strokes that the frame cuts.
///
/// The measured spread does not see noise that a bound at 0 has made sparse: then it is `noise` and `noiseAlong` that
/// keep it from being taken for rain, and a noise of 0 means that there is none.
/// Values that are not finite count as 0. Throws Error(InvalidArgument) naming an option out of range, Error(Internal)
/// for pictures of more than one channel.
std::vector<RainStroke> findRainStrokes(std::span<const ImageF> alphas, const RainStrokeOptions& options);

/// What strokes say about the rain. Zeros where there are none.
struct RainStatistics {
    int count = 0;  // all strokes
    // Mean direction [rad], -pi/2..pi/2: circular over twice the angle, weighted with length^3 (the inverse variance of
    // a line's slope) times (isolation straightness plainness)^2, as strokes that cross others lie askew; biweight, so
    // that the few that lie far off do not turn it.
    double slant = 0;
    double slantSpread = 0;   // circular standard deviation [rad], the same weights without the biweight
    double meanLength = 0;    // [px], of strokes that are whole inside the frame
    double medianLength = 0;  // [px]
    double meanWidth = 0;     // [px]
    double density = 0;       // strokes a frame a megapixel
};
RainStatistics rainStatistics(std::span<const RainStroke> strokes, std::span<const ImageF> alphas);

}  // namespace virga::matte
