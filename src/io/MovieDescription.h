// What a movie is, in Virga's words: from its container, its pictures' time stamps and the first picture decoded.
#pragma once

#include "io/ColorConversion.h"
#include "io/FrameSource.h"
#include "io/MovieInput.h"
#include "io/Orientation.h"
#include "io/PictureIndex.h"

namespace virga::io {

struct MovieDescription {
    PlateInfo info;
    MovieOrigin origin;
    int pixelFormat = -1;  ///< as decoded; AVPixelFormat
    int codedWidth = 0, codedHeight = 0;
    PlanarFormat format;  ///< its samples
    YuvCoding coding;
    Orientation orientation;
    ColorClaim colorClaim;  ///< what its tags say of its colours
};

/// first  a decoded picture, or null if none of the first ones can be decoded. It knows better than the container what
///        format the pictures have (alpha beside a VP9 stream), how they are cropped and whether they are interlaced.
/// The colour space itself is not chosen. Throws Error(Input) for pixel formats and matrices that are not read.
MovieDescription describeMovie(const MovieInput& input, const PictureIndex& index, const AVFrame* first,
                               const ReadOptions& options);

/// What the decoder says of one picture.
Scan scanOf(const AVFrame& picture);

}  // namespace virga::io
