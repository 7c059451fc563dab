#include "io/SampleForm.h"

#include "io/ImageFormats.h"

namespace virga::io {

SampleForm sampleFormOf(const std::string& format, bool formatHasAlpha, const PlateInfo& plate,
                        const FrameExtras* extras, std::optional<bool> half)
{
    const bool isSame = extras != nullptr && extras->fileFormat == format && extras->bitDepth > 0;
    const int depth = isSame ? extras->bitDepth : plate.bitDepth;
    const bool isFloat = isSame ? extras->isFloat : plate.isFloat;
    SampleForm form;
    if (format == "openexr") {
        form.samples = half.value_or(!(isFloat && depth > 16)) ? SampleType::Half : SampleType::Float;
    } else if (format == "hdr") {
        form.samples = SampleType::Float;
    } else if (format == "tiff" && isFloat) {
        form.samples = isSame && depth == 16 ? SampleType::Half : SampleType::Float;
    } else if (format == "dpx") {
        const int bits = isFloat ? 10 : depth <= 8 && !isSame ? 10 : depth;
        form.samples = bits <= 8 ? SampleType::UInt8 : SampleType::UInt16;
        form.bits = bits <= 8 ? 0 : bits <= 10 ? 10 : bits <= 12 ? 12 : 16;
    } else if (format == "png" || format == "tiff") {
        form.samples = depth > 8 ? SampleType::UInt16 : SampleType::UInt8;
        if (format == "tiff" && (depth == 10 || depth == 12 || depth == 14)) form.bits = depth;
    }
    // OpenImageIO (2.4) loses the last alpha of a row whose 10-bit samples leave one over for a word of its own.
    if (format == "dpx" && form.bits == 10 && plate.hasAlpha && plate.width % 3 == 1) form.bits = 16;
    form.hasAlpha = plate.hasAlpha && formatHasAlpha && (extras == nullptr || !isSame || extras->hasAlpha);
    switch (alphaKindOf(format)) {
        case AlphaKind::Straight: form.isStraight = true; break;
        case AlphaKind::Multiplied: break;
        case AlphaKind::AsTheFileSays: form.isStraight = isSame ? extras->isStraight : !form.isFloat(); break;
    }
    form.isStraight = form.isStraight && form.hasAlpha;
    return form;
}

}  // namespace virga::io
