// Frames of a movie that nobody touches: their packets go into the new file as they are.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
}

#include <algorithm>
#include <string_view>

#include "core/Error.h"
#include "core/Log.h"
#include "io/CopyRange.h"
#include "io/FrameSource.h"
#include "io/MovieMetadata.h"
#include "io/MovieOutput.h"
#include "io/StreamCopy.h"
#include "io/Writers.h"

namespace virga::io {

using namespace libav;

namespace {

/// Packets are cut alike in containers of one family: nothing need be done to them.
bool isSameFamily(const AVFormatContext& plate, const MovieOutput& output)
{
    std::string_view names = plate.iformat->name;  // "mov,mp4,m4a,3gp,3g2,mj2"
    while (true) {
        const std::size_t comma = names.find(',');
        if (output.is(std::string(names.substr(0, comma)).c_str())) return true;
        if (comma == std::string_view::npos) return false;
        names.remove_prefix(comma + 1);
    }
}

}  // namespace

MovieCopyResult copyMoviePackets(const std::string& path, const MovieOrigin& origin,
                                 const std::vector<FrameNumber>& frames, const std::string& container,
                                 const std::function<bool(std::size_t)>& goesOn)
{
    const Input movie = openPlateMovie(origin.path);
    if (!movie) return {"the plate cannot be opened again"};
    MovieOutput output(path, container);
    const AVStream& pictures = *movie->streams[origin.streamIndex];
    if (!isSameFamily(*movie, output) ||
        avformat_query_codec(output.context().oformat, pictures.codecpar->codec_id, FF_COMPLIANCE_NORMAL) == 0)
        return {"it goes into another container"};
    if (frames.size() < origin.times.size())
        if (std::string obstacle = obstacleToCut(*movie, origin, frames); !obstacle.empty()) return {obstacle};

    const auto timeOf = [&](FrameNumber frame) { return origin.times.at(std::size_t(frame - origin.firstFrame)); };
    const bool fromStart = frames.front() == origin.firstFrame,
               toEnd = frames.size() == origin.times.size() ||
                       frames.back() == origin.firstFrame + FrameNumber(origin.times.size()) - 1;
    const FrameTime first = timeOf(frames.front()), last = timeOf(frames.back());
    const std::int64_t zero = fromStart ? std::min(origin.containerStart, first.start) : first.start;
    const std::optional<std::int64_t> end = toEnd ? std::nullopt : std::optional(last.start + last.duration);

    StreamCopy copy(origin, output, StreamCopy::Pictures::Copied);
    copyFileMetadata(*movie, output.context());
    if (!origin.timecode.empty()) {
        const FrameNumber count = frames.front() - origin.firstFrame;
        const auto timecode = count == 0 ? origin.timecode : timecodeAfter(origin.timecode, origin.frameRate, count);
        if (timecode)
            av_dict_set(output.isMatroska() ? &output.context().metadata : &output.context().streams[0]->metadata,
                        "timecode", timecode->c_str(), 0);
        else
            log::warning("{}: the plate's timecode {} does not fit its rate and is left out", output.name(),
                         origin.timecode);
    }
    const double tick = double(origin.timeBase.num) / origin.timeBase.den;
    copyChapters(*movie, output.context(), double(zero) * tick,
                 end ? std::optional(double(*end) * tick) : std::nullopt);
    output.open();
    copy.begin(zero, fromStart ? std::nullopt : std::optional(zero));
    output.begin(origin.timeBase.num == 1 && origin.timeBase.den >= 1000 ? origin.timeBase.den : 0);
    std::size_t copied = 0;
    const auto isWanted = [&](std::int64_t time) {
        return (fromStart || time >= first.start) && (toEnd || time <= last.start);
    };
    copy.copyWithPictures(
        end, isWanted, [&](std::int64_t) { ++copied; }, [&] { return copied == 0 || goesOn(copied); });
    output.finish();
    return {"", copied};
}

}  // namespace virga::io
