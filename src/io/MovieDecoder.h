// The decoded picture with a given number, exactly, whatever was asked for before.
//
// A picture is reached by seeking to the last key picture that is not shown after it and decoding forward until the
// picture with its time stamp comes out, so that leading pictures of an open GOP, which need the GOP before, are never
// taken from a seek to their own GOP. H.264 pictures on the way that nothing is built on are not decoded. Where the
// container has no time stamps or cannot seek, decoding starts at the first packet.
#pragma once

#include <deque>
#include <limits>
#include <string>

#include "core/FrameRange.h"
#include "io/PictureIndex.h"

namespace virga::io {

class MovieDecoder {
public:
    /// Both must outlive it. firstFrame: the number of picture 0 in sentences. Throws Error(Input) for a codec that is
    /// not known here.
    MovieDecoder(MovieInput& input, const PictureIndex& index, FrameNumber firstFrame);

    /// The picture at `index` in the order of showing; ascending is fastest. Throws Error(Input) naming file and frame
    /// if it does not come, or comes with parts that the decoder had to make up.
    libav::Frame picture(std::size_t index);

private:
    static constexpr std::int64_t nowhere = std::numeric_limits<std::int64_t>::min();

    void open();
    void forget();
    void restart();
    bool seekTo(const Picture& key, std::int64_t target);
    bool reach(std::size_t index);
    bool go(std::size_t index);
    bool decodeUntil(std::int64_t target);
    void send(const AVPacket& packet);
    void feed();
    const AVFrame* kept(std::int64_t time) const;
    const AVFrame& checked(std::size_t index) const;

    MovieInput& input_;
    const PictureIndex& index_;
    FrameNumber firstFrame_;
    libav::Complaints complaints_;  // outlives the decoder, which points to it
    libav::Codec decoder_;

    struct Decoded {
        std::int64_t time;  // presentation
        libav::Frame frame;
    };
    std::deque<Decoded> last_;         // the pictures that the decoder gave last, newest at the back
    std::int64_t lastTime_ = nowhere;  // presentation time of the newest
    std::int64_t counted_ = 0;         // pictures since restart(), lost ones included
    std::int64_t target_ = nowhere;    // presentation time of the picture that is decoded towards
    bool skips_ = false;               // what is shown before target_ and nothing is built on
    bool drained_ = false;             // the decoder has been told that there are no more packets
};

}  // namespace virga::io
