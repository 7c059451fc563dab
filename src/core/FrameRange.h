// Which frames: "1-10", "1-10x2", "-8--5", "10-1x-1", several separated by commas or spaces (Foundry's frame range).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace virga {

/// Frames are named by number; a movie's first is 0, a sequence's are its own.
using FrameNumber = std::int64_t;

/// Frames in the order that the text names them, each one once (its first mention counts).
/// Throws Error(InvalidArgument) naming the text and the part that does not parse, or if it names over `limit` frames.
std::vector<FrameNumber> parseFrameRange(std::string_view text, std::size_t limit = 10'000'000);

/// The shortest text that parseFrameRange reads back: {1,2,3,5,7,9} -> "1-3,5-9x2".
std::string formatFrameRange(const std::vector<FrameNumber>& frames);

}  // namespace virga
