// What a movie's file says of itself beside its pictures' format: tags of colour, timecode, what else is in it. For
// people to read (`virga info`); nothing is decided by it.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace virga::io {

class PlateReader;

struct MovieFacts {
    /// FFmpeg's names ("bt709", "smpte2084", "left", "limited"); empty if the file does not say.
    std::string range, matrix, primaries, transfer, chromaLocation;
    bool isRangeGuessed = false, isMatrixGuessed = false;  ///< of a file that does not say: what it is taken for
    std::string timecode;                                  ///< of the first frame; empty: none
    std::string orientation;                               ///< what is done to the coded picture to show it: "upright"

    /// A stream beside the pictures.
    struct Stream {
        std::string kind;             ///< "sound", "subtitles", "data", "attachment", "cover"
        std::string codec;            ///< FFmpeg's name, else the four letters of the container
        std::string language, title;  ///< empty: not said; of an attachment its file's name
        int channels = 0, rate = 0;   ///< of sound [1/s]
        double start = 0;             ///< [s]
    };
    std::vector<Stream> streams;

    struct Chapter {
        double start, end;  ///< [s]
        std::string title;
    };
    std::vector<Chapter> chapters;

    /// SMPTE ST 2086: chromaticities of red, green, blue and white, and luminances [cd/m2].
    struct MasteringDisplay {
        std::array<std::array<double, 2>, 4> chromaticities;
        double least, most;
    };
    std::optional<MasteringDisplay> masteringDisplay;
    struct LightLevel {
        unsigned content, average;  ///< CTA-861.3: of the brightest pixel, of the brightest frame's mean [cd/m2]
    };
    std::optional<LightLevel> lightLevel;
    std::optional<int> dolbyVisionProfile;
};

/// Nothing for plates that are no movie. `plate` comes from openPlate.
std::optional<MovieFacts> movieFacts(const PlateReader& plate);

}  // namespace virga::io
