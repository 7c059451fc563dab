// Frames out of interlaced pictures: one frame for each picture, at the time of its first field.
//
// FFmpeg's bwdif filter (Bob Weaver: the w3fdif lines of BBC R&D, Weston's three-field interpolation, where yadif finds
// motion) with send_frame: the lines of the first field stay bit for bit, those of the second are made anew from the
// picture and its two neighbours. Every picture is taken as interlaced, also those that the decoder does not mark.
#pragma once

#include <string>

#include "io/Libav.h"
#include "io/Plate.h"

namespace virga::io {

class Deinterlacer {
public:
    /// scan: which field is first. Throws Error(Input) naming the movie `name` if its pixel format or size cannot be
    /// deinterlaced (packed pixels, palettes, fewer than 3 columns or 4 rows).
    Deinterlacer(std::string name, int pixelFormat, int width, int height, Scan scan);

    /// A function of these three alone, so that a frame is the same in whatever order frames are asked for. Neighbours
    /// may be null at the ends of the movie; the picture then stands in.
    libav::Frame picture(const AVFrame* before, const AVFrame& frame, const AVFrame* after) const;

private:
    std::string name_;
    int pixelFormat_, width_, height_;
    Scan scan_;
};

}  // namespace virga::io
