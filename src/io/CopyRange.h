// Which frames can be cut out of a movie packet by packet, such that they decode to what they were.
//
// A run of frames can if its packets are one run in the order of decoding, too, and the first of them needs none before
// it: then nothing that they build on is missing, and nothing that is shown outside comes along. That is any run where
// every picture stands alone (ProRes, DNxHD, MJPEG), else one from the start of a closed group of pictures to a picture
// that no earlier one waits for.
#pragma once

#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "io/FrameSource.h"

struct AVFormatContext;

namespace virga::io {

/// Why `frames` (consecutive and ascending, all of them there) cannot be cut out; empty if they can. `movie`: the
/// plate's, opened; where it is read to is not kept.
std::string obstacleToCut(AVFormatContext& movie, const MovieOrigin& origin, const std::vector<FrameNumber>& frames);

}  // namespace virga::io
