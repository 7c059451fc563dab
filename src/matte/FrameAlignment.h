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
//
// Here are the order of the work and what it says of a frame. Below, from the pixels up: FramePyramid, FrameFeatures,
// FrameRefinement, FrameJudgement, FramePlacement, FrameNeighbourhood; their maths is PlaneTransform. FrameWarp, which
// is included, resamples.
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"
#include "matte/FrameWarp.h"
#include "matte/Homography.h"

namespace virga::matte {

struct AlignmentOptions {
    int mostFeatures = 800;       // looked for in a frame, >= 8
    int polishes = 2;             // against the median of the frames nearby, >= 0. A second one is what clips of few
                                  // frames need: 0.04 px become 0.03, with movers 0.08 0.03
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

}  // namespace virga::matte
