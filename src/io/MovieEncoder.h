// Which encoder, and how it is set up: from the output's name, the plate, and what the user asks for.
#pragma once

#include <string>

#include "io/FrameSource.h"
#include "io/Libav.h"

namespace virga::io {

struct MovieFormat {
    int pixelFormat = 0;  ///< how the encoder takes its pictures, AV_PIX_FMT_*
    PlanarFormat planar;  ///< the same samples in planes; the encoder's own layout, unless it takes packed pixels alone
    YuvCoding coding;
    std::string colorspace;  ///< of the codes
};

/// Opens the encoder for `output`, whose container is known. Throws Error(InvalidArgument) for an encoder that is not
/// known, does not fit the container or refuses its settings or the plate's rate. `timeBase`: that the frames should
/// have; the encoder's own is as near to it as the codec takes.
libav::Codec openEncoder(const std::string& path, const AVFormatContext& output, const PlateInfo& plate,
                         const MovieOrigin* origin, const WriteOptions& options, Rational timeBase,
                         MovieFormat& format);

/// The frame rate that a movie made from this plate has.
Rational movieFrameRate(const PlateInfo& plate, const MovieOrigin* origin);

}  // namespace virga::io
