// One image file at a time, below the writers.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/Image.h"
#include "io/FrameSource.h"

namespace virga::io {

enum class SampleType { UInt8, UInt16, Half, Float };

/// One channel on its way into a file.
struct ChannelToWrite {
    std::string name;
    SampleType type;
    ConstImageViewF pixels;  ///< with at least `index` + 1 channels
    int index;
};

/// An image on its way into a file.
struct ImageToWrite {
    std::vector<ChannelToWrite> channels;
    int bits = 0;  ///< of integers that use less than their type holds (10-bit DPX); 0: all
    bool isStraight = false;
    std::string compression;  ///< OpenImageIO's words, "zip", "jpeg:95"; empty: the format's own
    double pixelAspect = 1;
    double fps = 0;  ///< 0: not written
    std::vector<Attribute> attributes;
};

/// Writes atomically. Integers are rounded to nearest and clipped, NaN is 0. Finite values too large for half become
/// +-65504; their number is returned. Throws Error(Output) naming the file.
std::size_t writeImageFile(const std::string& path, const ImageToWrite& image);

/// 24000/1001 and its kin are what film and video run at; anything else to a thousandth.
std::array<int, 2> rateFraction(double fps);

}  // namespace virga::io
