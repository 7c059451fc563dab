#include "io/MovieInput.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "core/Error.h"

namespace virga::io {

namespace fs = std::filesystem;
using namespace libav;

namespace {

void checkIsFile(const std::string& path)
{
    std::error_code error;
    if (fs::is_directory(path, error))
        throw Error(ErrorCode::Input, "{}: is a folder; name a movie, an image or a pattern such as {}", path,
                    (fs::path(path) / "shot.%04d.exr").string());
    if (!fs::exists(path, error)) throw Error(ErrorCode::Input, "{}: does not exist", path);
    if (!fs::is_regular_file(path, error)) throw Error(ErrorCode::Input, "{}: is a device, not a movie", path);
    if (fs::file_size(path, error) == 0) throw Error(ErrorCode::Input, "{}: is empty", path);
}

}  // namespace

std::vector<int> videoStreamsOf(const AVFormatContext& container)
{
    std::vector<int> streams;
    for (unsigned i = 0; i < container.nb_streams; ++i) {
        const AVStream& stream = *container.streams[i];
        if (stream.codecpar->codec_type == AVMEDIA_TYPE_VIDEO &&
            (stream.disposition & (AV_DISPOSITION_ATTACHED_PIC | AV_DISPOSITION_TIMED_THUMBNAILS)) == 0)
            streams.push_back(int(i));
    }
    return streams;
}

MovieInput::MovieInput(const std::string& path, std::optional<int> number) : name_(path)
{
    routeMessages();
    if (isPipe(path)) {
        if (path == "-") name_ = "standard input";
        spool_ = std::make_unique<PipeSpool>(path);
    } else {
        checkIsFile(path);
    }
    reopen();
    chooseStream(number);
}

AVStream* MovieInput::stream() const { return container_->streams[streamIndex_]; }

void MovieInput::reopen()
{
    AVFormatContext* context = nullptr;
    int result = avformat_open_input(&context, urlOf(path()).c_str(), nullptr, nullptr);
    if (result < 0)
        throw Error(ErrorCode::Input, "{}: is not a movie that can be read ({}){}", name_, errorText(result),
                    spool_ ? "; raw pictures have to come with a header: -f nut, -f matroska or -f yuv4mpegpipe" : "");
    // What the streams hold is found by decoding some of them, 20 ms at 1080p. QuickTime's packets do not change by it.
    const bool isKnown = streamIndex_ >= 0 && std::string_view(context->iformat->name).starts_with("mov,");
    container_.reset(context);
    result = isKnown ? 0 : avformat_find_stream_info(context, nullptr);
    if (result < 0) throw Error(ErrorCode::Input, "{}: is damaged ({})", name_, errorText(result));
    if (streamIndex_ >= int(context->nb_streams))
        throw Error(ErrorCode::Input, "{}: has changed while it was being read", name_);
    if (streamIndex_ < 0) return;
    for (unsigned i = 0; i < context->nb_streams; ++i)
        if (int(i) != streamIndex_) context->streams[i]->discard = AVDISCARD_ALL;
}

void MovieInput::chooseStream(std::optional<int> number)
{
    const std::vector<int> streams = videoStreamsOf(*container_);
    if (streams.empty()) throw Error(ErrorCode::Input, "{}: holds no video", name_);
    if (number && (*number < 0 || *number >= int(streams.size())))
        throw Error(ErrorCode::InvalidArgument, "{}: has no video stream {}; it has {}", name_, *number,
                    streams.size() == 1 ? std::string("only 0") : fmt::format("0 to {}", streams.size() - 1));
    const int best = av_find_best_stream(container_.get(), AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
    const bool bestIsVideo = std::find(streams.begin(), streams.end(), best) != streams.end();
    streamIndex_ = number ? streams[std::size_t(*number)] : bestIsVideo ? best : streams.front();
    for (unsigned i = 0; i < container_->nb_streams; ++i)
        if (int(i) != streamIndex_) container_->streams[i]->discard = AVDISCARD_ALL;
    if (stream()->codecpar->width <= 0 || stream()->codecpar->height <= 0)
        throw Error(ErrorCode::Input, "{}: its video has no size; the file is damaged or cut off", name_);
}

bool MovieInput::read(AVPacket& packet)
{
    while (av_read_frame(container_.get(), &packet) >= 0) {
        if (packet.stream_index == streamIndex_ && packet.size > 0) return true;
        av_packet_unref(&packet);
    }
    return false;
}

}  // namespace virga::io
