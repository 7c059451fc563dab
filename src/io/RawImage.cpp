// Single images outside of any plate: depth, mattes, panoramas, previews.

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "core/Error.h"
#include "core/Log.h"
#include "io/AtomicFile.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "io/ImageWrite.h"
#include "io/Plate.h"

namespace virga::io {

RawImage readRawImage(const std::string& path)
{
    ImageHeader header;
    RawImage image;
    image.pixels = readAllChannels(path, header, false);
    image.channelNames = header.channelNames;
    image.isFloat = header.isFloat;
    image.bitDepth = header.bitDepth;
    image.isDisplayReferred = !header.isFloat && header.colorClaims.front().colorspace == "sRGB";
    return image;
}

std::string wholeImageSoftware(const std::string& path)
{
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) return "";
    try {
        ImageHeader header;
        readAllChannels(path, header, false);
        for (const Attribute& attribute : header.attributes)
            if (attribute.name == "Software" && attribute.strings.size() == 1) return attribute.strings[0];
    } catch (const Error&) {  // cut off, or no image at all
    }
    return "";
}

bool keepsSoftware(const std::string& path)
{
    static constexpr std::string_view formats[] = {"openexr", "png", "tiff", "jpeg", "dpx", "targa"};
    return std::find(std::begin(formats), std::end(formats), imageFormatOf(path)) != std::end(formats);
}

ImageF readLinearImage(const std::string& path, const std::string& colorspace, const std::string& ocio,
                       ColorClaim* found)
{
    const auto colors = ColorConfig::open(ocio);
    ImageHeader header;
    ImageF rgba = readCodedRgba(path, header);
    const ColorClaim claim = chooseColorspace(*colors, colorspace, path, header.colorClaims);
    const auto toWorking = colors->transform(claim.colorspace, colors->working(claim.colorspace));
    codesToLinear(rgba, *toWorking, header.isStraight, header.hasAlpha);
    if (found != nullptr) *found = claim;
    if (header.hasAlpha) return rgba;
    ImageF rgb(rgba.width(), rgba.height(), 3);
    for (int y = 0; y < rgb.height(); ++y)
        for (int x = 0; x < rgb.width(); ++x)
            for (int c = 0; c < 3; ++c) rgb.at(x, y, c) = rgba.at(x, y, c);
    return rgb;
}

void writeExr(const std::string& path, ConstImageViewF pixels, const std::vector<std::string>& channelNames, bool half,
              const char* compression)
{
    checkOutputFolder(path);
    if (imageFormatOf(path) != "openexr")
        throw Error(ErrorCode::Output, "{}: this is written as EXR, name it .exr", path);
    ImageToWrite image;
    image.compression = compression;
    for (int c = 0; c < pixels.channels(); ++c)
        image.channels.push_back(
            {channelNames.at(std::size_t(c)), half ? SampleType::Half : SampleType::Float, pixels, c});
    writeImageFile(path, image);
}

namespace {

std::shared_ptr<const ColorTransform> displayTransform(const ColorConfig& colors, const std::string& space)
{
    const NamedSpace* known = colors.equivalent(space);
    const bool isData = known != nullptr && known->primaries == nullptr;
    try {
        if (!isData) return colors.transform(space, "sRGB");
    } catch (const Error& error) {
        log::detail("a preview is shown as if its colours were Rec.709: {}", error.what());
    }
    return makeColorTransform("Linear Rec.709", "sRGB");
}

}  // namespace

void writePng(const std::string& path, ConstImageViewF linear)
{
    writePng(path, linear, *ColorConfig::builtIn(), "Linear Rec.709");
}

void writePng(const std::string& path, ConstImageViewF linear, const ColorConfig& colors, const std::string& space)
{
    checkOutputFolder(path);
    if (imageFormatOf(path) != "png") throw Error(ErrorCode::Output, "{}: this is written as PNG, name it .png", path);
    ImageF codes(linear.width(), linear.height(), linear.channels());
    for (int y = 0; y < codes.height(); ++y)
        std::copy_n(linear.row(y), std::size_t(codes.width()) * std::size_t(codes.channels()), codes.row(y));
    linearToCodes(codes, *displayTransform(colors, space), true);
    static const char* const names[] = {"R", "G", "B", "A"};
    ImageToWrite image;
    image.isStraight = codes.channels() == 4;
    for (int c = 0; c < codes.channels(); ++c) image.channels.push_back({names[c], SampleType::UInt8, codes, c});
    writeImageFile(path, image);
}

}  // namespace virga::io
