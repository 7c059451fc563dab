// An EXR once more with another picture in it: all other parts, views, channels and attributes as they are, by OpenEXR
// itself, which knows every one of their types.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/Window.h"
#include "io/ImageWrite.h"

namespace virga::io {

/// What is new. Pixels are premultiplied codes as they are to stand in the file, RGBA.
struct ExrChanges {
    int part = 0;                          ///< the picture's
    std::array<std::string, 4> channels;   ///< its names there, red to alpha: "left.R"; alpha may be empty
    bool isUntouched = false;              ///< the picture is the file's; pixels are copied as they are packed
    ConstImageViewF picture{};             ///< over the display window
    ConstImageViewF overscan{};            ///< over the data window, of the file; empty if that lies in the display's
    Window data{}, display{};              ///< as in the file
    std::optional<SampleType> samples{};   ///< Half or Float for the picture's channels; nothing: each as it is
    std::vector<ChannelToWrite> layers{};  ///< more channels for the part, over the display window
    std::string compression{};             ///< of the part; empty: as it is if that loses nothing, else zip
    std::optional<double> quality{};       ///< of DWA
    bool dropsColour = false;              ///< what is said of the picture's colour space holds no longer
    std::optional<std::array<float, 8>> chromaticities{};  ///< if the file says none, or dropsColour
    std::string interopId{};                               ///< the same
    std::map<std::string, std::string> texts{};            ///< attributes
    double fps = 0;                                        ///< 0: as it is
};

/// Copies `from` to `to`, atomically. The data window is the file's, grown to hold the display window where the picture
/// has something beyond it. Parts that hold nothing of the picture are copied as they are packed, bit for bit; so are
/// other channels of its part, unless a lossy compression was asked for. Returns the number of values that were too
/// large for half and are held at 65504. Throws Error(Input) if `from` is damaged, Error(Output).
std::size_t rewriteExr(const std::string& from, const std::string& to, const ExrChanges& changes);

}  // namespace virga::io
