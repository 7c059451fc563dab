// How noisy footage is, and where: what an alpha has to stand out of.
#pragma once

#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

/// The standard deviation of one value in each block of the picture. Blocks are those that codecs work in: what they
/// copy from frame to frame, sharpen or blur changes from one to the next, and so do swaying leaves.
struct NoiseMap {
    static constexpr int block = 16;  // [px]

    ImageF sigma;        // one value a block, 1 channel, > 0, in the footage's units
    double typical = 0;  // their median

    /// Of the block that holds pixel (x, y).
    float at(int x, int y) const { return sigma.at(x / block, y / block); }
};

/// The standard deviation of noise from how far values lie below the scene: from the median of those depths that are
/// more than `repeated`, as a normal distribution would have it. Codecs repeat blocks from frame to frame; half of the
/// values then equal the scene's and say nothing of the noise that is met where a block is coded anew. 0 if less than
/// 64 depths are left. The depths are put out of order.
double darkDeviation(std::vector<float>& depths, double repeated);

/// How much of more than 4 frames is looked at: half of the pixels of every second frame, or of every fourth from 12
/// frames on, which leaves an error of about 5 %.
enum class NoiseSamples { Many, Few };

/// From the dark side of the scene alone, where rain is not (darkDeviation), times what a scene that was made of these
/// frames lies too near to them; a block that is repeated from frame to frame counts as the few pictures that it is. A
/// block with too few values there takes the typical deviation; none is taken for less noisy than a quarter of that, or
/// than `least` (> 0).
///
///   trust     one a frame, or none: values that are not trusted are left out
///   repeated  depths up to this are left out, >= 0
///   own       ownFrames(frames, repeated), for who asks for more than one map of the same frames; may be null
NoiseMap noiseMap(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene, double least,
                  double repeated, NoiseSamples samples = NoiseSamples::Many, const ImageF* own = nullptr);

/// How many frames of its own each block has, a pixel a block: so many make a mean as noisy as that of all frames, some
/// of which repeat the one before to within `repeated`.
ImageF ownFrames(std::span<const ImageF> frames, double repeated);

}  // namespace virga::matte
