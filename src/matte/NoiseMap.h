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

/// From the dark side of the scene alone, where rain is not: the root of the mean square of how far trusted values lie
/// below it. Values that equal the scene's are left out: codecs that repeat a block make many of them, and they say
/// nothing of the noise that alpha meets in the frames that were coded anew. A block with fewer than 64 such samples
/// takes the typical value; none is taken for less noisy than a quarter of that, or than `least` (> 0). trust  one a
/// frame, or none.
NoiseMap noiseMap(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene, double least);

}  // namespace virga::matte
