// The part of a movie's pictures that its container says is to be shown: the clean aperture of MP4 and MOV (ISO
// 14496-12, 12.1.4, box 'clap') and Matroska's PixelCrop (RFC 9559, 5.1.4.1.28). FFmpeg 5.1 reads neither. Cropping
// that is part of the video itself (H.264, HEVC) is another thing, and the decoder does it.
#pragma once

#include <optional>
#include <string>

struct AVStream;

namespace virga::io {

struct CleanAperture {
    double left = 0, top = 0, width = 0, height = 0;  // of the coded picture [px]
};

/// path     of the file
/// demuxer  FFmpeg's name of its kind; others than MP4's and Matroska's have none
/// Nothing if there is none, it is all of the picture, or the file is not laid out as it should be. Reads headers
/// alone. Does not throw.
std::optional<CleanAperture> cleanApertureOf(const std::string& path, const std::string& demuxer,
                                             const AVStream& stream, int codedWidth, int codedHeight) noexcept;

}  // namespace virga::io
