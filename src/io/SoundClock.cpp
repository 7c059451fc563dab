#include "io/SoundClock.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/intreadwrite.h>
#include <libavutil/mathematics.h>
}

#include <cstdlib>
#include <cstring>
#include <new>

namespace virga::io {

SoundClock::SoundClock(const AVStream& stream, bool toTheSample) : stream_(&stream), toTheSample_(toTheSample)
{
    tick_ = av_rescale_q_rnd(1, stream.time_base, {1, stream.codecpar->sample_rate}, AV_ROUND_UP);
}

void SoundClock::toSamples(AVPacket& packet)
{
    const AVCodecParameters& parameters = *stream_->codecpar;
    const AVRational sample{1, parameters.sample_rate}, tick = stream_->time_base;
    const bool isExact = av_cmp_q(sample, tick) == 0;
    const auto isNear = [&](std::int64_t a, std::int64_t b) { return !isExact && std::llabs(a - b) <= tick_; };

    std::int64_t duration = av_rescale_q(packet.duration, tick, sample);
    if (isNear(duration, parameters.frame_size)) duration = parameters.frame_size;
    std::int64_t start = av_rescale_q(packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts, tick, sample);
    const std::int64_t expected = isFirst_ ? -std::int64_t(parameters.initial_padding) : end_;
    if (toTheSample_ && isNear(start, expected)) start = expected;
    isFirst_ = false;
    end_ = start + duration;

    packet.pts = packet.dts = start;
    packet.duration = duration;
    packet.time_base = sample;
}

namespace {

// AV_PKT_DATA_SKIP_SAMPLES: two counts of 32 bits, from the start and from the end, and two reasons.
constexpr std::size_t skipSize = 10, endAt = 4;

}  // namespace

std::int64_t discardedSamples(const AVPacket& packet)
{
    std::size_t size = 0;
    const std::uint8_t* data = av_packet_get_side_data(&packet, AV_PKT_DATA_SKIP_SAMPLES, &size);
    return data != nullptr && size >= skipSize ? AV_RL32(data + endAt) : 0;
}

void setDiscardedSamples(AVPacket& packet, std::int64_t samples)
{
    std::size_t size = 0;
    std::uint8_t* data = av_packet_get_side_data(&packet, AV_PKT_DATA_SKIP_SAMPLES, &size);
    if (size < skipSize) {
        if (samples == 0) return;
        data = av_packet_new_side_data(&packet, AV_PKT_DATA_SKIP_SAMPLES, skipSize);
        if (data == nullptr) throw std::bad_alloc();
    }
    std::memset(data, 0, skipSize);
    AV_WL32(data + endAt, std::uint32_t(samples));
}

std::int64_t prerollOf(const AVStream& stream)
{
    const AVCodecDescriptor* descriptor = avcodec_descriptor_get(stream.codecpar->codec_id);
    const bool isLossless = descriptor != nullptr && (descriptor->props & AV_CODEC_PROP_LOSSLESS) != 0 &&
                            (descriptor->props & AV_CODEC_PROP_LOSSY) == 0;
    return isLossless ? 0 : stream.codecpar->sample_rate / 10;
}

}  // namespace virga::io
