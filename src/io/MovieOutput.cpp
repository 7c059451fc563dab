#include "io/MovieOutput.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "core/Error.h"
#include "core/Log.h"

namespace virga::io {

namespace fs = std::filesystem;
using namespace libav;

namespace {

/// Containers that are written from front to back.
constexpr const char* streamable[] = {"nut", "matroska", "webm", "mpegts", "yuv4mpegpipe", "mp4", "mov"};

const AVOutputFormat* containerNamed(const std::string& word)
{
    if (const AVOutputFormat* format = av_guess_format(word.c_str(), nullptr, nullptr)) return format;
    return av_guess_format(nullptr, ("x." + word).c_str(), nullptr);
}

const AVOutputFormat* chooseContainer(const std::string& path, const std::string& container)
{
    const bool isPipe = path == standardOutput;
    if (container.empty()) {
        if (isPipe)
            throw Error(
                ErrorCode::InvalidArgument,
                "standard output has no name that tells the container; give it with --container: nut, matroska, "
                "webm, mpegts, y4m, mp4 or mov");
        const AVOutputFormat* format = av_guess_format(nullptr, path.c_str(), nullptr);
        if (format == nullptr)
            throw Error(
                ErrorCode::Output,
                "{}: is no movie format that can be written; there are .mp4, .mov, .mkv, .webm, .avi, .mxf, .nut, "
                ".y4m",
                path);
        return format;
    }
    const AVOutputFormat* format = containerNamed(container);
    if (format == nullptr || format->video_codec == AV_CODEC_ID_NONE || (format->flags & AVFMT_NOFILE) != 0)
        throw Error(
            ErrorCode::InvalidArgument,
            "--container '{}': must be a container for movies, such as mp4, mov, matroska, webm, mxf, avi, nut or "
            "y4m",
            container);
    const auto isThis = [&](const char* name) { return std::strcmp(format->name, name) == 0; };
    if (isPipe && std::none_of(std::begin(streamable), std::end(streamable), isThis))
        throw Error(
            ErrorCode::InvalidArgument,
            "--container '{}': cannot be written to standard output; nut, matroska, webm, mpegts, y4m, mp4 and mov "
            "can",
            container);
    return format;
}

/// The codec's setup as a file of this container holds it. Packets that come out of one are cut in its way (H.264 and
/// HEVC: lengths instead of start codes), which the muxer knows by the setup alone.
void takeSetup(AVCodecParameters& to, const AVCodecParameters& stored)
{
    av_freep(&to.extradata);
    to.extradata_size = 0;
    if (stored.extradata_size <= 0) return;
    to.extradata =
        static_cast<std::uint8_t*>(av_mallocz(std::size_t(stored.extradata_size) + AV_INPUT_BUFFER_PADDING_SIZE));
    if (to.extradata == nullptr) throw std::bad_alloc();
    std::memcpy(to.extradata, stored.extradata, std::size_t(stored.extradata_size));
    to.extradata_size = stored.extradata_size;
}

/// A stream like `from`, which was set up for another file of the same container, of packets that lie in `stored`.
void addStreamLike(AVFormatContext& to, const AVStream& from, const AVStream& stored)
{
    AVStream* stream = avformat_new_stream(&to, nullptr);
    if (stream == nullptr || avcodec_parameters_copy(stream->codecpar, from.codecpar) < 0) throw std::bad_alloc();
    takeSetup(*stream->codecpar, *stored.codecpar);
    stream->time_base = from.time_base;
    stream->avg_frame_rate = from.avg_frame_rate;
    stream->sample_aspect_ratio = from.sample_aspect_ratio;
    stream->disposition = from.disposition;
    av_dict_copy(&stream->metadata, from.metadata, 0);
    for (int i = 0; i < from.nb_side_data; ++i) {
        const AVPacketSideData& data = from.side_data[i];
        std::uint8_t* copy = av_stream_new_side_data(stream, data.type, data.size);
        if (copy == nullptr) throw std::bad_alloc();
        std::memcpy(copy, data.data, data.size);
    }
}

}  // namespace

MovieOutput::MovieOutput(const std::string& path, const std::string& container)
    : path_(path), name_(path == standardOutput ? "standard output" : path), isPipe_(path == standardOutput)
{
    const AVOutputFormat* format = chooseContainer(path, container);
    AVFormatContext* context = nullptr;
    if (avformat_alloc_output_context2(&context, format, nullptr, path.c_str()) < 0) throw std::bad_alloc();
    context_.reset(context);
    // Y4M deeper than 8 bits and FLAC in MP4 are standards that FFmpeg still calls young; elsewhere leniency makes
    // files that nobody can read.
    if (is("yuv4mpegpipe")) context->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
    if (is("mp4")) context->strict_std_compliance = FF_COMPLIANCE_EXPERIMENTAL;
    context->flush_packets = 1;  // what was muxed is in the file if we are killed
}

bool MovieOutput::is(const char* muxer) const { return std::strcmp(context_->oformat->name, muxer) == 0; }
bool MovieOutput::isIsoMedia() const { return is("mp4") || is("mov") || is("ipod") || is("3gp") || is("3g2"); }
bool MovieOutput::isMatroska() const { return is("matroska") || is("webm"); }

void MovieOutput::check(int result) const
{
    if (result < 0) throw Error(ErrorCode::Output, "{}: cannot be written ({})", name_, errorText(result));
}

void MovieOutput::open()
{
    if (isPipe()) {
        // A reader that goes away is an error to be told, not a signal to die of.
        std::signal(SIGPIPE, SIG_IGN);
        check(avio_open(&context_->pb, "pipe:1", AVIO_FLAG_WRITE));
        return;
    }
    leftovers_ = findLeftovers(path_);
    for (const std::string& left : leftovers_)
        log::warning("{}: an earlier run was cut off and left {}, which is removed when this one is whole", name_,
                     left);
    file_.emplace(path_);
    check(avio_open(&context_->pb, urlOf(file_->temporaryPath()).c_str(), AVIO_FLAG_WRITE));
    log::detail("{}: until it is whole it is {}, which plays up to the last finished group of pictures", name_,
                file_->temporaryPath());
}

void MovieOutput::begin(int trackTimescale)
{
    trackTimescale_ = trackTimescale;
    ends_.assign(context_->nb_streams, {});
    // Who writes packets before the zero knows why; FFmpeg would move the pictures with them.
    if (isMatroska()) context_->avoid_negative_ts = AVFMT_AVOID_NEG_TS_DISABLED;
    AVDictionary* options = nullptr;
    if (isIsoMedia()) {
        // The table of a fragmented file waits for the first packets (delay_moov): some codecs are described by them,
        // and so are edit lists.
        av_dict_set(&options, "movflags", "+frag_keyframe+delay_moov+default_base_moof", 0);
        tagColor(&options);
        if (trackTimescale > 0) av_dict_set_int(&options, "video_track_timescale", trackTimescale, 0);
    }
    const int result = avformat_write_header(context_.get(), &options);
    av_dict_free(&options);
    check(result);
    // AAC out of a broadcast stream carries headers that have no place here. FFmpeg's muxer does not take them off
    // where it writes fragments, whose table it expects before the first packet; here the table waits for that.
    for (unsigned i = 0; i < context_->nb_streams; ++i)
        if (const AVCodecParameters& p = *context_->streams[i]->codecpar;
            p.codec_id == AV_CODEC_ID_AAC && p.extradata_size == 0)
            context_->flags |= AVFMT_FLAG_AUTO_BSF;
}

/// An atom of colour that says "unspecified" would still say that the range is limited.
void MovieOutput::tagColor(AVDictionary** options) const
{
    for (unsigned i = 0; i < context_->nb_streams; ++i)
        if (const AVCodecParameters& p = *context_->streams[i]->codecpar;
            p.codec_type == AVMEDIA_TYPE_VIDEO &&
            (p.color_range != AVCOL_RANGE_UNSPECIFIED || p.color_primaries != AVCOL_PRI_UNSPECIFIED ||
             p.color_trc != AVCOL_TRC_UNSPECIFIED || p.color_space != AVCOL_SPC_UNSPECIFIED))
            av_dict_set(options, "movflags", "+write_colr", AV_DICT_APPEND);
}

void MovieOutput::write(AVPacket& packet)
{
    if (isRewritten()) {
        Ends& ends = ends_[std::size_t(packet.stream_index)];
        if (packet.dts == AV_NOPTS_VALUE) packet.dts = packet.pts;
        if (!ends.first) ends.first = packet.dts;
        ends.last = packet.dts;
        ends.duration = packet.duration;
    }
    check(av_interleaved_write_frame(context_.get(), &packet));
}

void MovieOutput::finish()
{
    check(av_write_trailer(context_.get()));
    avio_flush(context_->pb);
    check(context_->pb->error);
    check(avio_closep(&context_->pb));
    if (isPipe()) return;
    deliver();
    removeLeftovers(leftovers_);
}

void MovieOutput::deliver()
{
    if (!isRewritten()) return file_->commit();
    std::string problem;
    try {
        AtomicFile plain(file_->finalPath(), "finishing");
        if (rewrite(plain, problem)) return plain.commit();
    } catch (const Error& error) {
        problem = error.what();
    }
    log::warning("{}: stays a fragmented file, which plays but is slower to open: it cannot be rewritten ({})", name_,
                 problem);
    file_->commit();
}

bool MovieOutput::rewrite(AtomicFile& plain, std::string& problem)
{
    // Times as they are stored: the edit list would move them.
    AVDictionary* readOptions = nullptr;
    av_dict_set(&readOptions, "ignore_editlist", "1", 0);
    AVFormatContext* opened = nullptr;
    int result = avformat_open_input(&opened, urlOf(file_->temporaryPath()).c_str(), nullptr, &readOptions);
    av_dict_free(&readOptions);
    const Input input(opened);
    if (result < 0 || input->nb_streams < context_->nb_streams) {
        problem = result < 0 ? errorText(result) : "streams are missing";
        return false;
    }
    input->flags |= AVFMT_FLAG_NOPARSE | AVFMT_FLAG_NOFILLIN;

    AVFormatContext* made = nullptr;
    if (avformat_alloc_output_context2(&made, context_->oformat, nullptr, plain.finalPath().c_str()) < 0)
        throw std::bad_alloc();
    const Output output(made);
    // The muxer opens the file a second time, by this name, to move the table to the front.
    av_free(output->url);
    output->url = av_strdup(urlOf(plain.temporaryPath()).c_str());
    for (unsigned i = 0; i < context_->nb_streams; ++i)
        addStreamLike(*output, *context_->streams[i], *input->streams[i]);
    av_dict_copy(&output->metadata, context_->metadata, 0);
    std::swap(output->chapters, context_->chapters);
    std::swap(output->nb_chapters, context_->nb_chapters);

    AVDictionary* options = nullptr;
    av_dict_set(&options, "movflags", "+faststart", 0);
    tagColor(&options);
    if (trackTimescale_ > 0) {
        av_dict_set_int(&options, "video_track_timescale", trackTimescale_, 0);
        // Edit lists count in the movie's ticks: as fine as the pictures', so that sound stays where it was.
        av_dict_set_int(&options, "movie_timescale", trackTimescale_, 0);
    }
    result = avio_open(&output->pb, urlOf(plain.temporaryPath()).c_str(), AVIO_FLAG_WRITE);
    if (result >= 0) result = avformat_write_header(output.get(), &options);
    av_dict_free(&options);

    std::vector<std::optional<std::int64_t>> shifts(ends_.size());
    while (result >= 0) {
        const Packet packet = makePacket();
        result = av_read_frame(input.get(), packet.get());
        if (result == AVERROR_EOF) break;
        if (result < 0 || std::size_t(packet->stream_index) >= ends_.size()) continue;
        const std::size_t index = std::size_t(packet->stream_index);
        const AVRational from = input->streams[index]->time_base, to = output->streams[index]->time_base;
        av_packet_rescale_ts(packet.get(), from, to);
        const auto written = [&](std::int64_t time) {
            return av_rescale_q(time, context_->streams[index]->time_base, to);
        };
        // A track's own zero is where its first packet lies.
        if (!shifts[index]) shifts[index] = written(ends_[index].first.value_or(0)) - packet->dts;
        packet->dts += *shifts[index];
        if (packet->pts != AV_NOPTS_VALUE) packet->pts += *shifts[index];
        if (packet->dts >= written(ends_[index].last)) packet->duration = written(ends_[index].duration);
        packet->pos = -1;
        result = av_interleaved_write_frame(output.get(), packet.get());
    }
    if (result == AVERROR_EOF) result = av_write_trailer(output.get());
    if (output->pb != nullptr) {
        avio_flush(output->pb);
        if (result >= 0) result = output->pb->error;
        const int closed = avio_closep(&output->pb);
        if (result >= 0) result = closed;
    }
    if (result < 0) {
        problem = errorText(result);
        return false;
    }
    return true;
}

}  // namespace virga::io
