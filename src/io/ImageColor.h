// What an image file says of its colours.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "io/ColorConversion.h"

namespace virga::io {

/// The words of a header that have to do with colour; empty where it is silent.
struct ImageColorWords {
    bool isFloat = false;              ///< half or float
    std::string interopId{};           ///< "colorInteropID" of EXR
    std::optional<ColorClaim> cicp{};  ///< of a PNG's chunk cICP, the words of movies
    bool isAcesContainer = false;      ///< "acesImageContainerFlag" of EXR, SMPTE ST 2065-4
    std::string profile{};             ///< description of the ICC profile
    bool hasProfile = false;           ///< there is one, described or not
    std::string transfer{};            ///< OpenImageIO's "oiio:ColorSpace", where the file and not its kind says so
    std::optional<std::array<float, 8>> chromaticities{};  ///< of EXR
};

/// Claims for chooseColorspace, the weightiest first: interop ID, cICP, ACES container, ICC profile (known by its
/// description, which is not applied), chromaticities, transfer. The guess, last: floats are linear light in Rec.709,
/// integers sRGB.
std::vector<ColorClaim> colorClaims(const ImageColorWords& words);

/// The interop ID for a space of ours: the Color Interop Forum's, else one in our namespace, "virga:arri_logc4".
std::string interopIdOf(const NamedSpace& space);

}  // namespace virga::io
