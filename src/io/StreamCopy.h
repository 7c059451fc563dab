#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "io/FrameSource.h"
#include "io/MovieOutput.h"

namespace virga::io {

/// Copies what a movie holds beside its pictures into another one, packet by packet and unchanged: sound, subtitles,
/// timed data (GoPro's telemetry, KLV) and attached files (fonts). Kept beside the pictures in time: call copyUntil as
/// they are written. With Pictures::Copied the pictures' own packets go along (MovieCopy.cpp).
///
/// Sound stays in step to the sample. What an encoder put before the first sample (AAC's and Opus's priming), and what
/// a decoder has to hear before a cut, stays before the zero: MP4 and MOV hide it by their edit list; Matroska, which
/// has no times before zero, holds it in packets at zero that are discarded whole (DiscardPadding), so that sound
/// begins to the nearest packet there, and so it does after a cut in other containers.
class StreamCopy {
public:
    enum class Pictures { LeftOut, Copied };

    /// Adds a stream to `output` for each of the plate's that its container can hold, and warns of each that it cannot.
    StreamCopy(const MovieOrigin& origin, MovieOutput& output, Pictures pictures);
    ~StreamCopy();

    /// `zero`: the plate's time that becomes 0. `cutStart`: the time before which packets are left out. In units of the
    /// plate's video time base. Call once, before the header is written.
    void begin(std::int64_t zero, std::optional<std::int64_t> cutStart);

    /// Everything that begins before `end` (plate's video time base). Throws Error(Output).
    void copyUntil(std::int64_t end);
    void copyAll();

    /// With the pictures: those whose presentation time `isWanted` says so of, and of the rest what begins before `end`
    /// (nothing: all). `wrote` is told each picture's presentation time; before a key picture `goesOn` may end the
    /// copy.
    void copyWithPictures(std::optional<std::int64_t> end, const std::function<bool(std::int64_t)>& isWanted,
                          const std::function<void(std::int64_t)>& wrote, const std::function<bool()>& goesOn);

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace virga::io
