// A movie whose pictures nobody touches: its packets go into the new file as they are.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dict.h>
}

#include <algorithm>
#include <string_view>

#include "core/Error.h"
#include "core/Log.h"
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

MovieCopyResult copyMoviePackets(const std::string& path, const MovieOrigin& origin, const std::string& container,
                                 const std::function<bool(std::size_t)>& goesOn)
{
    const Input movie = openPlateMovie(origin.path);
    if (!movie) return {"the plate cannot be opened again"};
    MovieOutput output(path, container);
    const AVStream& pictures = *movie->streams[origin.streamIndex];
    if (!isSameFamily(*movie, output) ||
        avformat_query_codec(output.context().oformat, pictures.codecpar->codec_id, FF_COMPLIANCE_NORMAL) == 0)
        return {"it goes into another container"};

    StreamCopy copy(origin, output, StreamCopy::Pictures::Copied);
    copyFileMetadata(*movie, output.context());
    if (!origin.timecode.empty())
        av_dict_set(output.isMatroska() ? &output.context().metadata : &output.context().streams[0]->metadata,
                    "timecode", origin.timecode.c_str(), 0);
    const std::int64_t zero = std::min(origin.containerStart, origin.times[0].start);
    const double tick = double(origin.timeBase.num) / origin.timeBase.den;
    copyChapters(*movie, output.context(), double(zero) * tick, std::nullopt);
    output.open();
    copy.begin(zero, std::nullopt);
    output.begin(origin.timeBase.num == 1 && origin.timeBase.den >= 1000 ? origin.timeBase.den : 0);
    std::size_t copied = 0;
    copy.copyWithPictures(
        std::nullopt, [](std::int64_t) { return true; }, [&](std::int64_t) { ++copied; },
        [&] { return copied == 0 || goesOn(copied); });
    output.finish();
    return {"", copied};
}

}  // namespace virga::io
