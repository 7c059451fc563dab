// One image file at a time, below the readers: what its header says, and its pixels. Writing: ImageWrite.h,
// ExrRewrite.h.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/Window.h"
#include "io/ColorConversion.h"
#include "io/FrameSource.h"
#include "io/ImageFormats.h"
#include "io/Orientation.h"
#include "io/PictureChannels.h"

namespace virga::io {

/// What the header of an image file says: of its first part, or of the one that the picture is in.
struct ImageHeader {
    std::string format;         ///< OpenImageIO's name: "openexr", "png"
    int width = 0, height = 0;  ///< of the display window, upright
    Window data, display;       ///< as in the file
    Orientation orientation;    ///< what is done to the file's rows to have them upright
    std::vector<std::string> channelNames;
    PictureChannels picture;                  ///< where the picture is; meaningless for readImageHeader
    std::array<std::string, 4> pictureNames;  /// of its channels, red to alpha; empty for alpha that there is not
    int bitDepth = 8;
    bool isFloat = false;     ///< half or float
    bool isStraight = false;  ///< colours are not multiplied by alpha
    bool hasAlpha = false;
    double pixelAspect = 1;
    double fps = 0;                       ///< 0: it does not say
    std::vector<ColorClaim> colorClaims;  ///< for chooseColorspace
    std::vector<Attribute> attributes;
    std::vector<std::string> layers, views;  ///< of a picture, in the order of the file
    std::vector<std::string> beside;         ///< what the file holds beside the picture, see besidePicture
};

/// A 4x4 matrix among the attributes (whatever their case), 16 numbers in the file's order; nothing if there is none.
std::optional<std::array<double, 16>> matrixAttribute(const ImageHeader& header, std::string_view name);

/// Throws Error(Input) naming the file; also where the header promises more pixels than the machine has memory for.
ImageHeader readImageHeader(const std::string& path);
/// Of the picture that readCodedRgba would give. Throws Error(Input) as it does.
ImageHeader readPictureHeader(const std::string& path, const PictureChoice& choice = {});

/// All channels in the order of the file, of an EXR those of all its flat parts, "part.Z" where several have a Z;
/// placed in the display window, upright; 0 where the data
/// window does not reach, and what lies outside the display window (overscan) is left out. Half and float are as in the
/// file, bit for bit. Integers are 0..1 if `normalize`, else the numbers that they are, of their own bits (10-bit DPX:
/// 0 to 1023; above 2^24 to the nearest float). Throws Error(Input) naming the file.
ImageF readAllChannels(const std::string& path, ImageHeader& header, bool normalize);

/// R G B A as the file holds them, not converted: grey is repeated, alpha is 1 where there is none. See choosePicture.
/// Of the display window, as readAllChannels. Integers of 32 bits are data and refused. `overscan`, if not null, gets
/// the whole data window if that reaches beyond the display window, and else stays as it is. Throws Error(Input).
ImageF readCodedRgba(const std::string& path, ImageHeader& header, const PictureChoice& choice = {},
                     ImageF* overscan = nullptr);

/// Straight or premultiplied code values -> premultiplied linear, in place. Does nothing at all to premultiplied pixels
/// if the transform is the identity. Premultiplied colours under an alpha of 0 (light that covers nothing) are
/// converted as if alpha were 1.
void codesToLinear(ImageF& rgba, const ColorTransform& toLinear, bool isStraight, bool hasAlpha);
/// Premultiplied linear -> premultiplied or straight code values, in place. 3 channels, or 4 of which the last is
/// alpha.
void linearToCodes(ImageView<float> pixels, const ColorTransform& toCodes, bool isStraight);

}  // namespace virga::io
