// How the encoder of a movie is set up: from the plate, and what the user asks for.
#pragma once

#include <string>

#include "io/FrameSource.h"
#include "io/Libav.h"
#include "io/MovieMetadata.h"

namespace virga::io {

struct MovieFormat {
    int pixelFormat = 0;  ///< how the encoder takes its pictures, AV_PIX_FMT_*
    PlanarFormat planar;  ///< the same samples in planes; the encoder's own layout, unless it takes packed pixels alone
    YuvCoding coding;
    std::string colorspace;     ///< of the codes
    bool isInterlaced = false;  ///< the plate's two fields go through as one picture
    bool isTopFirst = false;
};

/// What the pictures are, beside what a frame says.
struct MovieSubject {
    const PlateInfo& plate;
    const MovieOrigin* origin;  // null: images
    HdrMetadata hdr;
};

/// Opens the encoder for `output`, whose container is known. Throws Error(InvalidArgument) for an encoder that is not
/// known, does not fit the container or refuses its settings or the plate's rate. `timeBase`: that the frames should
/// have; the encoder's own is as near to it as the codec takes.
libav::Codec openEncoder(const std::string& path, const AVFormatContext& output, const MovieSubject& subject,
                         const WriteOptions& options, Rational timeBase, MovieFormat& format);

/// The frame rate that a movie made from this plate has.
Rational movieFrameRate(const PlateInfo& plate, const MovieOrigin* origin);

}  // namespace virga::io
