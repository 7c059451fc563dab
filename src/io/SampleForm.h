// The samples of an image file that is written: of which type, in which colours, under which alpha.
#pragma once

#include <optional>
#include <string>

#include "io/FrameSource.h"
#include "io/ImageWrite.h"

namespace virga::io {

struct SampleForm {
    SampleType samples = SampleType::UInt8;
    int bits = 0;  ///< of integers that use less than their type holds; 0: all
    bool hasAlpha = false;
    bool isStraight = false;  ///< colours not multiplied by alpha
    bool isFloat() const { return samples == SampleType::Half || samples == SampleType::Float; }
};

/// Of a file in `format` (OpenImageIO's name) for a frame of the plate. In the plate's own format each file is as the
/// one that it came from (`extras`, may be null), else the plate's first frame decides: its depth and alpha as far as
/// the format holds them, EXR as half unless `half` says otherwise or the plate is float, integers straight where the
/// format has either (TIFF).
SampleForm sampleFormOf(const std::string& format, bool formatHasAlpha, const PlateInfo& plate,
                        const FrameExtras* extras, std::optional<bool> half);

}  // namespace virga::io
