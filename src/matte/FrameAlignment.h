// Registration of footage whose camera shakes, drifts or pans slowly, so that a scene that stands can be solved from
// it. One homography a frame: exact for a camera that turns about its lens, or that moves before a plane (Hartley and
// Zisserman 2004, section 13.1).
//
// It does not hold for a camera that walks: near things move against far ones (parallax), and no homography brings all
// of them together. Nor does it hold for a rolling shutter that shakes, a lens that distorts and is panned, or a scene
// that is mostly in motion. The frame is then aligned to what most of the picture agrees on, and `inlierShare` falls or
// `residual_px` grows: these two are what to judge by. A static model is worth solving from about inlierShare > 0.7,
// less the part of the picture that is in motion, and residual_px < 0.4; hand-held footage of a park whose median comes
// out sharp has 0.95 and up to 0.35.
//
// A homography takes a point (x, y) of the frame to one of the reference; pixel centres as in docs/conventions.md.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

/// Row by row: (x, y) goes to ((m0 x + m1 y + m2) / w, (m3 x + m4 y + m5) / w), w = m6 x + m7 y + m8 > 0 [px].
struct Homography {
    std::array<double, 9> m = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    /// Of a point; not finite where w is 0.
    std::array<double, 2> operator()(double x, double y) const;
    /// Scaled so that m8 is 1 where it can be. Of a singular one: the identity.
    Homography inverse() const;
};

struct AlignmentOptions {
    int mostFeatures = 800;       // looked for in a frame, >= 8
    double minOverlap = 0.5;      // a frame that shares less of its area with the reference is refined against an
                                  // aligned frame nearer to it, 0..1
    double minInlierShare = 0.2;  // of a frame that counts as found, 0..1
};

struct FrameAlignment {
    Homography referenceFromFrame;
    bool found = false;
    double residual_px = 0;  // rms over the inliers of the displacement that the homography leaves [px]
    double inlierShare =
        0;                 // of the textured cells of the picture, those that are left less than 1 px from their place
    double motion_px = 0;  // the largest displacement of a corner of the frame [px]
};

/// Where each frame lies against frames[reference], 1 or 3 channels of any range of values. Frames that cannot be
/// placed have the identity and found = false; the reference has the identity and is found by definition.
///
/// Frames are chained through their neighbours: SIFT matches (Lowe 2004) of small pictures, a homography that the least
/// truncated squares choose (MSAC, Torr and Zisserman 2000). Then each is refined on pixels against the reference, or
/// against an aligned frame where the two share too little, so that errors do not add up: inverse compositional
/// Gauss-Newton (Baker and Matthews 2004) over a pyramid, with gain and offset of the brightness and Tukey's biweight
/// on what remains, so that rain and what moves have no say. Where the texture does not determine eight parameters it
/// is an affinity, a similarity or a shift that is found. Clips of five frames and more are refined again, against the
/// median of the nearest nine without the frame itself, in which there is no rain.
///
/// Within 0.05 px rms on texture under rain on a fifth of each frame, noise, an exposure that breathes by a tenth, and
/// movers on a fifth of the picture; each step from one aligned frame to the next adds about as much
/// (tests/matte/frame_alignment_test.cpp). Where little of the frame lies on the reference the rest is extrapolated.
/// Neighbours may be apart by about a quarter of the picture. Takes a third of a float a pixel and frame besides the
/// frames. The same for any number of threads. Values that are not finite count as 0. Throws Error(Internal) for frames
/// that differ in size, for a reference that is not one of them and for options out of range.
std::vector<FrameAlignment> alignFrames(std::span<const ImageF> frames, int reference,
                                        const AlignmentOptions& options = {});

/// The frame resampled into the reference's grid, of the same size: cubic (Keys 1981, a = -1/2: Catmull-Rom), which
/// keeps detail and may overshoot at edges; exact for the identity. Where the frame does not reach it is 0, and
/// `covered` (1 channel, may be null) is 0 instead of 1. The frame reaches to its outermost pixel centres.
ImageF warpToReference(const ImageF& frame, const Homography& referenceFromFrame, ImageF* covered = nullptr);

/// The way back: a picture in the reference's grid, resampled into the frame's.
ImageF warpFromReference(const ImageF& picture, const Homography& referenceFromFrame, ImageF* covered = nullptr);

}  // namespace virga::matte
