#include "io/StreamCopy.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mathematics.h>
}

#include <algorithm>
#include <deque>
#include <limits>
#include <map>
#include <set>

#include "core/Error.h"
#include "core/Log.h"
#include "io/MovieMetadata.h"
#include "io/SoundClock.h"

namespace virga::io {

using namespace libav;

namespace {

const char* kindOf(const AVStream& stream)
{
    if ((stream.disposition & AV_DISPOSITION_ATTACHED_PIC) != 0) return "cover picture";
    switch (stream.codecpar->codec_type) {
        case AVMEDIA_TYPE_AUDIO: return "sound";
        case AVMEDIA_TYPE_SUBTITLE: return "subtitles";
        case AVMEDIA_TYPE_ATTACHMENT: return "attached file";
        case AVMEDIA_TYPE_VIDEO: return "second video";
        default: return "timed data";
    }
}

std::string nameOf(const AVStream& stream)
{
    if (stream.codecpar->codec_id != AV_CODEC_ID_NONE) return avcodec_get_name(stream.codecpar->codec_id);
    char tag[AV_FOURCC_MAX_STRING_SIZE] = {};
    return stream.codecpar->codec_tag != 0 ? av_fourcc_make_string(tag, stream.codecpar->codec_tag)
                                           : "of no known kind";
}

/// Tracks that say in their own way what the muxer writes anew: timecode, and the texts of chapters.
bool isWrittenAnew(const AVFormatContext& input, const AVStream& stream)
{
    const std::uint32_t tag = stream.codecpar->codec_tag;
    if (stream.codecpar->codec_type != AVMEDIA_TYPE_DATA) return false;
    return tag == MKTAG('t', 'm', 'c', 'd') || (tag == MKTAG('t', 'e', 'x', 't') && input.nb_chapters > 0);
}

/// The name that the codec has in the plate's container where the new one knows it too, else the new one's own.
std::uint32_t tagFor(const AVOutputFormat& container, const AVCodecParameters& parameters)
{
    if (container.codec_tag == nullptr) return 0;
    return av_codec_get_id(container.codec_tag, parameters.codec_tag) == parameters.codec_id ? parameters.codec_tag : 0;
}

bool canHold(const MovieOutput& output, const AVStream& stream)
{
    const AVCodecParameters& p = *stream.codecpar;
    switch (p.codec_type) {
        case AVMEDIA_TYPE_ATTACHMENT: return output.is("matroska");
        case AVMEDIA_TYPE_DATA:
            // The one kind of data that these muxers know how to name, and MOV's does not.
            if (output.isIsoMedia() || output.isMatroska())
                return output.isIsoMedia() && p.codec_tag == MKTAG('g', 'p', 'm', 'd') &&
                       tagFor(*output.context().oformat, p) != 0;
            break;
        case AVMEDIA_TYPE_AUDIO:
            if (output.is("mxf") && (p.sample_rate != 48000 ||
                                     (p.codec_id != AV_CODEC_ID_PCM_S16LE && p.codec_id != AV_CODEC_ID_PCM_S24LE)))
                return false;  // SMPTE 382M, as far as the muxer goes
            break;
        case AVMEDIA_TYPE_SUBTITLE: break;
        default: return false;
    }
    return p.codec_id != AV_CODEC_ID_NONE &&
           avformat_query_codec(output.context().oformat, p.codec_id, FF_COMPLIANCE_NORMAL) != 0;
}

}  // namespace

struct StreamCopy::State {
    MovieOutput* output = nullptr;
    Input input;
    int videoIndex = -1;  // of the input; -1 if its pictures are not copied
    AVRational videoTimeBase{0, 1};
    std::map<int, int> outputStreams;  // by the stream's index in the input
    std::map<int, SoundClock> clocks;  // of the sound among them
    std::int64_t zero = 0;
    std::optional<std::int64_t> cutStart;
    std::deque<Packet> waiting;  // read, but not due yet
    bool isAtEnd = false;

    bool isCopied(const AVPacket& packet) const
    {
        return outputStreams.contains(packet.stream_index) && timeOf(packet) != AV_NOPTS_VALUE;
    }

    static std::int64_t timeOf(const AVPacket& packet)
    {
        return packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts;
    }

    bool isSound(const AVPacket& packet) const { return clocks.contains(packet.stream_index); }

    /// The middle of a packet decides on which side of a cut it is.
    bool isBefore(const AVPacket& packet, std::int64_t cut) const
    {
        return av_compare_ts(timeOf(packet) + packet.duration / 2, packet.time_base, cut, videoTimeBase) < 0;
    }

    /// Later than any packet that is stored beside what ends at `end`.
    bool isLongAfter(const AVPacket& packet, std::int64_t end) const
    {
        const std::int64_t stored = packet.dts != AV_NOPTS_VALUE ? packet.dts : packet.pts;
        constexpr AVRational aside{10, 1};  // 10 s; containers interleave within one
        return av_compare_ts(stored - av_rescale_q(1, aside, packet.time_base), packet.time_base, end, videoTimeBase) >
               0;
    }

    /// Before the cut, and not needed by what is after it.
    bool isCutOff(const AVPacket& packet) const
    {
        if (!cutStart || packet.stream_index == videoIndex) return false;
        if (!isSound(packet) || !(output->isIsoMedia() || output->isMatroska())) return isBefore(packet, *cutStart);
        const std::int64_t cut = av_rescale_q(*cutStart, videoTimeBase, packet.time_base);
        return timeOf(packet) + packet.duration <= cut - prerollOf(*input->streams[packet.stream_index]);
    }

    /// The next packet into `waiting`, its time_base set; false at the end.
    bool read()
    {
        while (!isAtEnd) {
            Packet packet = makePacket();
            if (av_read_frame(input.get(), packet.get()) < 0) {
                isAtEnd = true;
                break;
            }
            if (!isCopied(*packet)) continue;
            packet->time_base = input->streams[packet->stream_index]->time_base;
            if (const auto clock = clocks.find(packet->stream_index); clock != clocks.end())
                clock->second.toSamples(*packet);
            if (isCutOff(*packet)) continue;
            waiting.push_back(std::move(packet));
            return true;
        }
        return false;
    }

    void write(AVPacket& packet)
    {
        const int index = outputStreams.at(packet.stream_index);
        const std::int64_t shift = av_rescale_q(zero, videoTimeBase, packet.time_base);
        if (packet.pts != AV_NOPTS_VALUE) packet.pts -= shift;
        if (packet.dts != AV_NOPTS_VALUE) packet.dts -= shift;
        if (output->isMatroska() && packet.stream_index != videoIndex) keepAfterZero(packet);
        packet.pos = -1;
        packet.stream_index = index;
        av_packet_rescale_ts(&packet, packet.time_base, output->context().streams[index]->time_base);
        output->write(packet);
    }

    /// For Matroska. Its muxer writes the delay of Opus, by which readers move the packets back, and moves none itself.
    void keepAfterZero(AVPacket& packet) const
    {
        const AVCodecParameters& parameters = *input->streams[packet.stream_index]->codecpar;
        if (parameters.codec_id == AV_CODEC_ID_OPUS) packet.dts = packet.pts += parameters.initial_padding;
        if (packet.pts >= 0) return;
        if (isSound(packet) && packet.pts + packet.duration / 2 < 0) setDiscardedSamples(packet, packet.duration);
        packet.dts = packet.pts = 0;
    }

    /// Sound that is discarded at the start stands at the time of what is heard first, in Matroska: it is put back
    /// before that. Reads to the first packet of each sound that is heard.
    void placePriming()
    {
        std::set<int> begun;
        constexpr std::size_t most = 1000;  // a stream that begins much later has no priming
        while (begun.size() < clocks.size() && waiting.size() < most && read()) {
            const AVPacket& packet = *waiting.back();
            if (!isSound(packet) || (packet.duration > 0 && discardedSamples(packet) >= packet.duration) ||
                !begun.insert(packet.stream_index).second)
                continue;
            std::int64_t next = packet.pts;
            for (auto before = waiting.rbegin() + 1; before != waiting.rend(); ++before)
                if ((*before)->stream_index == packet.stream_index) {
                    next = std::min((*before)->pts, next - (*before)->duration);
                    (*before)->dts = (*before)->pts = next;
                    setDiscardedSamples(**before, 0);
                }
        }
    }
};

StreamCopy::StreamCopy(const MovieOrigin& origin, MovieOutput& output, Pictures pictures)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.output = &output;
    s.videoTimeBase = {origin.timeBase.num, origin.timeBase.den};
    s.input = openPlateMovie(origin.path);
    if (!s.input) return;
    for (unsigned i = 0; i < s.input->nb_streams; ++i) {
        AVStream& from = *s.input->streams[i];
        const bool isPicture = int(i) == origin.streamIndex;
        const bool isHidden = from.discard == AVDISCARD_ALL;  // the demuxer's own helpers
        from.discard = AVDISCARD_ALL;
        if (isHidden || isWrittenAnew(*s.input, from) || (isPicture && pictures == Pictures::LeftOut)) continue;
        if (!isPicture && !canHold(output, from)) {
            log::warning("{}: the plate's {} ({}) cannot be kept in a {} file and is left out", output.name(),
                         kindOf(from), nameOf(from), output.context().oformat->name);
            continue;
        }
        AVStream* to = avformat_new_stream(&output.context(), nullptr);
        if (to == nullptr || avcodec_parameters_copy(to->codecpar, from.codecpar) < 0) throw std::bad_alloc();
        to->codecpar->codec_tag = tagFor(*output.context().oformat, *from.codecpar);
        to->time_base = from.time_base;
        to->disposition = from.disposition;
        copyStreamMetadata(from, *to);
        if (isPicture) {
            s.videoIndex = int(i);
            to->avg_frame_rate = from.avg_frame_rate;
            to->r_frame_rate = from.r_frame_rate;
            to->sample_aspect_ratio = from.sample_aspect_ratio;
            copySideData(from, *to);
        }
        from.discard = AVDISCARD_DEFAULT;
        s.outputStreams[int(i)] = to->index;
        if (from.codecpar->codec_type == AVMEDIA_TYPE_AUDIO && from.codecpar->sample_rate > 0)
            s.clocks.emplace(int(i), SoundClock(from, !output.isMatroska()));
    }
}

StreamCopy::~StreamCopy() = default;

void StreamCopy::begin(std::int64_t zero, std::optional<std::int64_t> cutStart)
{
    state_->zero = zero;
    state_->cutStart = cutStart;
    if (state_->input) state_->placePriming();
}

void StreamCopy::copyAll() { copyUntil(std::numeric_limits<std::int64_t>::max()); }

void StreamCopy::copyUntil(std::int64_t end)
{
    State& s = *state_;
    while (!s.outputStreams.empty() && (!s.waiting.empty() || s.read())) {
        AVPacket& packet = *s.waiting.front();
        if (end != std::numeric_limits<std::int64_t>::max() && !s.isBefore(packet, end)) break;
        s.write(packet);
        s.waiting.pop_front();
    }
}

void StreamCopy::copyWithPictures(std::optional<std::int64_t> end, const std::function<bool(std::int64_t)>& isWanted,
                                  const std::function<void(std::int64_t)>& wrote, const std::function<bool()>& goesOn)
{
    State& s = *state_;
    while (!s.waiting.empty() || s.read()) {
        AVPacket& packet = *s.waiting.front();
        if (packet.stream_index == s.videoIndex) {
            const std::int64_t time = State::timeOf(packet);
            if (isWanted(time)) {
                if ((packet.flags & AV_PKT_FLAG_KEY) != 0 && !goesOn()) return;
                s.write(packet);
                wrote(time);
            } else if (end && s.isLongAfter(packet, *end)) {
                return;
            }
        } else if (!end || s.isBefore(packet, *end)) {
            s.write(packet);
        }
        s.waiting.pop_front();
    }
}

}  // namespace virga::io
