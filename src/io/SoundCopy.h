#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "io/FrameSource.h"
#include "io/Libav.h"

namespace virga::io {

/// Copies the sound and subtitles of the plate's movie into another one, packet by packet and unchanged. Kept beside
/// the pictures in time: call copyUntil as the pictures are written.
class SoundCopy {
public:
    /// Adds a stream to `output` for each of the plate's that its container can hold, and warns of each that it cannot.
    SoundCopy(const MovieOrigin& origin, AVFormatContext& output, const std::string& outputPath);
    ~SoundCopy();

    /// Whether there is anything to copy.
    bool isEmpty() const;

    /// `zero`: the plate's time that becomes 0. `cutStart`: the time before which packets are left out, to the nearest
    /// packet. In units of the plate's video time base. Call once, after the header is written.
    void begin(std::int64_t zero, std::optional<std::int64_t> cutStart);

    /// Everything that begins before `end` (plate's video time base). Throws Error(Output).
    void copyUntil(std::int64_t end);
    void copyAll();

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace virga::io
