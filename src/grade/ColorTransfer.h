// The colours of a reference still for a plate: Pitie, Kokaram & Dahyot 2005, "N-dimensional probability density
// function transfer and its application to colour transfer" (ICCV). The plate's cloud of colours is turned into the
// reference's by matching the distributions along one axis after another, in one rotated frame after another.
//
// What that gives is a displacement for each sampled colour; here it becomes one smooth 3-D table a shot, so that each
// frame is graded alike (no flicker) and the GPU needs one texture fetch. Matching stretches grain and bands where a
// narrow peak becomes a broad one; the authors repair that picture by picture, here the table itself is kept from
// stretching: where it would fold back (solarisation, hues turned into their opposites) or rise by more than
// `maxSlope`, seen along a channel, along grey or along a difference of two channels, it is made stiffer until it does
// not. Only what would be darker than black is cut off there.
//
// All of it happens on encoded values, where a step is a ratio in the lights and a difference in the blacks:
//   encode(c) = log2(1 + c / delta) / log2(1 + maximum / delta)   for c >= 0, continued below 0 with its slope there,
// which maps 0..maximum to 0..1. Scene-linear light in and out, unpremultiplied, the plate's primaries for both.
#pragma once

#include <array>
#include <vector>

#include "core/Image.h"

namespace virga::grade {

/// out = decode(e + d(clamp(e, 0, 1))), e = encode(c), d interpolated trilinearly: beyond the table, colours move as
/// its nearest face does, which is a constant gain in the lights.
struct ColorLut {
    int size = 0;            // nodes a side; 0 is the identity
    float delta = 0.02f;     // where the encoding turns from linear to logarithmic, scene-linear
    float maximum = 1;       // what encodes to 1, scene-linear
    std::vector<float> rgb;  // size^3 x 3 displacements d, encoded; node (r, g, b) at 3 ((b size + g) size + r), the
                             // memory order of a GL 3-D texture with red along x. Node i is at i / (size - 1): sample
                             // at (e (size - 1) + 1/2) / size

    /// True if no pixel changes: the pass is left out.
    bool isIdentity() const noexcept;
};

double encode(const ColorLut& lut, double linear) noexcept;
double decode(const ColorLut& lut, double encoded) noexcept;

/// One pixel through the table; NaN stays NaN in its channel. The reference for the GPU's grade pass. Does not throw.
std::array<double, 3> apply(const ColorLut& lut, const std::array<double, 3>& linear) noexcept;

struct ColorTransferOptions {
    double strength = 1;      // 0 leaves the plate as it is, 1 is the whole transfer; 0..1
    int size = 33;            // nodes a side, 2..129
    int samples = 20'000;     // pixels taken from the plate, and from the reference; >= 100
    int iterations = 30;      // rotated frames, >= 1; 30 are within 4/255 of 100 (two daylight frames, a rain still)
    double maxSlope = 2;      // how much more contrast the encoded plate may get anywhere, >= 1
    double smoothness = 0.3;  // pull between neighbouring nodes, where many samples pull with 1; 0.001..1000. At 1 and
                              // more the plate keeps more of its own colours, below 0.1 skies begin to show blocks
};

/// The table that gives the plate's frames (a few, spread over the shot) the reference's colours. The frames and the
/// reference need 3 channels or more; sizes may differ. Pixels that are not finite are left out, values below 0 count
/// as 0. A pure function of its arguments (the rotations are hashed), the same on any number of threads. A plate that
/// is its own reference gets the identity. Throws Error(InvalidArgument) naming an option out of range, Error(Input) if
/// a picture has under 3 channels or no finite pixel.
ColorLut makeColorTransfer(const std::vector<ConstImageViewF>& plate, ConstImageViewF reference,
                           const ColorTransferOptions& options = {});

}  // namespace virga::grade
