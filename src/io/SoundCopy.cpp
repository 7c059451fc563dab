#include "io/SoundCopy.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mathematics.h>
}

#include <limits>
#include <map>

#include "core/Error.h"
#include "core/Log.h"

namespace virga::io {

using namespace libav;

struct SoundCopy::State {
    std::string outputPath;
    AVFormatContext* output = nullptr;
    Input input;
    AVRational videoTimeBase{0, 1};
    std::map<int, int> outputStreams;  // by the stream's index in the input
    std::int64_t zero = 0;
    std::optional<std::int64_t> cutStart;
    Packet pending;  // read, but not due yet
    bool isAtEnd = false;
};

SoundCopy::SoundCopy(const MovieOrigin& origin, AVFormatContext& output, const std::string& outputPath)
    : state_(std::make_unique<State>())
{
    state_->outputPath = outputPath;
    state_->output = &output;
    state_->videoTimeBase = {origin.timeBase.num, origin.timeBase.den};
    AVFormatContext* context = nullptr;
    if (avformat_open_input(&context, origin.path.c_str(), nullptr, nullptr) < 0) return;
    state_->input.reset(context);
    if (avformat_find_stream_info(context, nullptr) < 0) return;
    for (unsigned i = 0; i < context->nb_streams; ++i) {
        AVStream& from = *context->streams[i];
        const AVCodecParameters& parameters = *from.codecpar;
        from.discard = AVDISCARD_ALL;
        if (parameters.codec_type != AVMEDIA_TYPE_AUDIO && parameters.codec_type != AVMEDIA_TYPE_SUBTITLE) continue;
        const char* kind = parameters.codec_type == AVMEDIA_TYPE_AUDIO ? "sound" : "subtitles";
        const char* container = output.oformat->name;
        if (parameters.codec_id == AV_CODEC_ID_NONE ||
            avformat_query_codec(output.oformat, parameters.codec_id, FF_COMPLIANCE_NORMAL) == 0) {
            log::warning("{}: the plate's {} ({}) cannot be kept in a {} file and is left out", outputPath, kind,
                         avcodec_get_name(parameters.codec_id), container);
            continue;
        }
        AVStream* to = avformat_new_stream(&output, nullptr);
        if (to == nullptr || avcodec_parameters_copy(to->codecpar, &parameters) < 0) throw std::bad_alloc();
        to->codecpar->codec_tag = 0;  // the container's own
        to->time_base = from.time_base;
        to->disposition = from.disposition;
        for (const char* key : {"language", "title", "handler_name"})
            if (const AVDictionaryEntry* entry = av_dict_get(from.metadata, key, nullptr, 0))
                av_dict_set(&to->metadata, key, entry->value, 0);
        from.discard = AVDISCARD_DEFAULT;
        state_->outputStreams[int(i)] = to->index;
    }
}

SoundCopy::~SoundCopy() = default;

bool SoundCopy::isEmpty() const { return state_->outputStreams.empty(); }

void SoundCopy::begin(std::int64_t zero, std::optional<std::int64_t> cutStart)
{
    state_->zero = zero;
    state_->cutStart = cutStart;
}

void SoundCopy::copyAll() { copyUntil(std::numeric_limits<std::int64_t>::max()); }

void SoundCopy::copyUntil(std::int64_t end)
{
    State& s = *state_;
    while (!isEmpty() && !s.isAtEnd) {
        if (!s.pending) {
            s.pending = makePacket();
            if (av_read_frame(s.input.get(), s.pending.get()) < 0) {
                s.isAtEnd = true;
                break;
            }
        }
        AVPacket& packet = *s.pending;
        const auto stream = s.outputStreams.find(packet.stream_index);
        const std::int64_t start = packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts;
        if (stream == s.outputStreams.end() || start == AV_NOPTS_VALUE) {
            s.pending.reset();
            continue;
        }
        const AVRational timeBase = s.input->streams[packet.stream_index]->time_base;
        // The middle of a packet decides on which side of a cut it is.
        const std::int64_t middle = start + packet.duration / 2;
        if (end != std::numeric_limits<std::int64_t>::max() &&
            av_compare_ts(middle, timeBase, end, s.videoTimeBase) >= 0)
            break;
        if (s.cutStart && av_compare_ts(middle, timeBase, *s.cutStart, s.videoTimeBase) < 0) {
            s.pending.reset();
            continue;
        }
        const std::int64_t shift = av_rescale_q(s.zero, s.videoTimeBase, timeBase);
        if (packet.pts != AV_NOPTS_VALUE) packet.pts -= shift;
        if (packet.dts != AV_NOPTS_VALUE) packet.dts -= shift;
        packet.pos = -1;
        packet.stream_index = stream->second;
        av_packet_rescale_ts(&packet, timeBase, s.output->streams[stream->second]->time_base);
        const int result = av_interleaved_write_frame(s.output, &packet);
        s.pending.reset();
        if (result < 0)
            throw Error(ErrorCode::Output, "{}: the plate's sound cannot be written ({})", s.outputPath,
                        errorText(result));
    }
}

}  // namespace virga::io
