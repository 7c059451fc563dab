// What a movie says about itself beside its streams, from the plate to the result: titles and dates, chapters, the
// start timecode, and what HDR displays are told.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/FrameSource.h"
#include "io/Libav.h"

struct AVStream;

namespace virga::io {

/// The plate's movie with its streams known; null if it cannot be opened any more.
libav::Input openPlateMovie(const std::string& path);

/// Titles, comments, dates, of the file. What the container and the encoder write themselves, and what is no longer
/// true (durations, statistics, rotation), stays behind.
void copyFileMetadata(const AVFormatContext& from, AVFormatContext& to);
/// The same of a stream: its title, language, handler.
void copyStreamMetadata(const AVStream& from, AVStream& to);
/// Everything that the container says about a stream's pictures: display matrix, mastering display, spherical mapping.
void copySideData(const AVStream& from, AVStream& to);

/// Chapters that overlap [start, end), cut to it and counted from its start. Times are seconds of the plate's own
/// clock. `end` of nothing: to the end.
void copyChapters(const AVFormatContext& from, AVFormatContext& to, double start, std::optional<double> end);

/// The timecode `frames` after `start` ("01:00:00:00", or "01:00:00;00" that drops frames) at this rate. Nothing if the
/// text is no timecode of the rate, such as drop-frame at 25.
std::optional<std::string> timecodeAfter(const std::string& start, Rational frameRate, std::int64_t frames);

/// What displays are told of HDR pictures, as FFmpeg's structures, byte for byte; empty if the movie does not say.
struct HdrMetadata {
    std::vector<std::uint8_t> masteringDisplay;  ///< AVMasteringDisplayMetadata, SMPTE ST 2086
    std::vector<std::uint8_t> lightLevel;        ///< AVContentLightMetadata, CTA-861.3
    bool isEmpty() const { return masteringDisplay.empty() && lightLevel.empty(); }
};
/// From the container, else from the first picture, where HEVC and AV1 keep it (it is decoded for that).
HdrMetadata readHdrMetadata(AVFormatContext& plate, int streamIndex);
void addHdrMetadata(const HdrMetadata& metadata, AVStream& stream);

/// The parameters that x265 and SVT-AV1 take for it, as "name=value" pairs.
std::vector<std::string> x265HdrParameters(const HdrMetadata& metadata);
std::vector<std::string> svtAv1HdrParameters(const HdrMetadata& metadata);

}  // namespace virga::io
