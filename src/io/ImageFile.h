// One image file at a time, below the readers and writers: OpenImageIO's files in our words.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/ColorConversion.h"
#include "io/FrameSource.h"

namespace virga::io {

/// What the header of an image file says.
struct ImageHeader {
    std::string format;         ///< OpenImageIO's name: "openexr", "png"
    int width = 0, height = 0;  ///< of the display window
    std::vector<std::string> channelNames;
    int bitDepth = 8;
    bool isFloat = false;     ///< half or float
    bool isStraight = false;  ///< colours are not multiplied by alpha
    bool hasAlpha = false;
    double pixelAspect = 1;
    double fps = 0;                       ///< 0: it does not say
    std::vector<ColorClaim> colorClaims;  ///< for chooseColorspace
    std::vector<Attribute> attributes;
    std::vector<std::string> layers;   ///< of a picture, in the order of the file
    std::vector<std::string> leftOut;  ///< of a picture, what of the file is not read: a sentence each
};

/// Whether files with this extension are images that can be read (else they may be movies).
bool isImageName(const std::string& path);

/// A 4x4 matrix among the attributes (whatever their case), 16 numbers in the file's order; nothing if there is none.
std::optional<std::array<double, 16>> matrixAttribute(const ImageHeader& header, std::string_view name);

/// Throws Error(Input) naming the file.
ImageHeader readImageHeader(const std::string& path);
/// Of the picture that readCodedRgba would give. Throws Error(Input) as it does.
ImageHeader readPictureHeader(const std::string& path, const std::string& layer);

/// All channels in the order of the file, placed in the display window; 0 where the data window does not reach, and
/// what lies outside the display window (overscan) is left out. Half and float are as in the file, bit for bit.
/// Integers are 0..1 if `normalize`, else as they are. Throws Error(Input) naming the file.
ImageF readAllChannels(const std::string& path, ImageHeader& header, bool normalize);

/// R G B A as the file holds them, not converted: grey is repeated, alpha is 1 where there is none. Of the first part.
/// layer: "diffuse" for diffuse.R, diffuse.G, diffuse.B; empty: the channels without one, else the only layer, else the
/// one called rgba, beauty or Combined. Throws Error(Input) listing the layers where that leaves a choice.
ImageF readCodedRgba(const std::string& path, ImageHeader& header, const std::string& layer = {});

/// Straight or premultiplied code values -> premultiplied linear, in place. Does nothing at all to premultiplied pixels
/// if the transform is the identity.
void codesToLinear(ImageF& rgba, const ColorTransform& toLinear, bool isStraight, bool hasAlpha);
/// Premultiplied linear -> premultiplied or straight code values, in place. 3 channels, or 4 of which the last is
/// alpha.
void linearToCodes(ImageView<float> pixels, const ColorTransform& toCodes, bool isStraight);

enum class SampleType { UInt8, UInt16, Half, Float };

/// An image on its way into a file.
struct ImageToWrite {
    struct Channel {
        std::string name;
        SampleType type;
        ConstImageViewF pixels;  ///< with at least `index` + 1 channels
        int index;
    };
    std::vector<Channel> channels;
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

/// Name of the format that files called `path` are written in ("openexr"). Throws Error(Output) listing what there is.
std::string imageFormatOf(const std::string& path);
bool formatHasAlpha(const std::string& path);

}  // namespace virga::io
