// Where packets of sound lie in time, to the sample.
//
// Matroska rounds times to milliseconds, 44 samples of 44100 Hz. The samples follow one another without a gap, so where
// a packet lies within a tick of where the one before it ended, it lies there.
#pragma once

#include <cstdint>

struct AVPacket;
struct AVStream;

namespace virga::io {

class SoundClock {
public:
    /// The stream has sound and a sample rate. toTheSample: whether starts are mended; into a container that rounds
    /// alike they go as they are.
    SoundClock(const AVStream& stream, bool toTheSample);

    /// Turns the packet's times and duration into samples (packet.time_base is 1 / sample rate). For the stream's
    /// packets in their order; each has a time.
    void toSamples(AVPacket& packet);

private:
    const AVStream* stream_;
    std::int64_t tick_ = 0;  // of the stream's clock [samples], rounded up
    std::int64_t end_ = 0;   // of the packet before [samples]
    bool toTheSample_, isFirst_ = true;
};

/// Samples at the end of the packet that are not to be heard (Matroska's DiscardPadding).
std::int64_t discardedSamples(const AVPacket& packet);
void setDiscardedSamples(AVPacket& packet, std::int64_t samples);

/// How much sound before a cut the decoder has to have heard for what follows to be right [samples]: none for codecs
/// without loss; 0.1 s covers the overlap of AAC and Vorbis, MP3's reservoir of bits and Opus (80 ms, RFC 7845, 4.6).
std::int64_t prerollOf(const AVStream& stream);

}  // namespace virga::io
