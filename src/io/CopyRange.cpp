#include "io/CopyRange.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <limits>
#include <span>

#include "core/Error.h"
#include "io/Libav.h"

namespace virga::io {

using namespace libav;

namespace {

/// Whether one of the packet's NAL units is a slice of an IDR picture (ITU-T H.264, table 7-1): containers also mark
/// pictures as keys from which decoding only becomes right after a while.
bool holdsIdr(std::span<const std::uint8_t> packet, const AVCodecParameters& parameters)
{
    constexpr int idr = 5;
    const auto kind = [](std::uint8_t header) { return header & 0x1f; };
    const bool hasLengths = parameters.extradata_size > 4 && parameters.extradata[0] == 1;  // ISO 14496-15, 5.3.3.1
    if (hasLengths) {
        const std::size_t lengthSize = std::size_t(parameters.extradata[4] & 3) + 1;
        for (std::size_t at = 0; packet.size() - at > lengthSize;) {
            std::size_t length = 0;
            for (std::size_t i = 0; i < lengthSize; ++i) length = length << 8 | packet[at + i];
            at += lengthSize;
            if (kind(packet[at]) == idr) return true;
            if (length == 0 || length > packet.size() - at) return false;
            at += length;
        }
        return false;
    }
    for (std::size_t i = 0; i + 3 < packet.size(); ++i)
        if (packet[i] == 0 && packet[i + 1] == 0 && packet[i + 2] == 1 && kind(packet[i + 3]) == idr) return true;
    return false;
}

/// The packet of the stream that is shown at `time`, found from the key picture before or from the start.
bool startsWithIdr(AVFormatContext& movie, int streamIndex, std::int64_t time)
{
    const Packet packet = makePacket();
    for (const std::int64_t from : {time, std::numeric_limits<std::int64_t>::min() / 2}) {
        if (av_seek_frame(&movie, streamIndex, from, AVSEEK_FLAG_BACKWARD) < 0) continue;
        for (; av_read_frame(&movie, packet.get()) >= 0; av_packet_unref(packet.get())) {
            if (packet->stream_index != streamIndex) continue;
            if (packet->pts == time)
                return holdsIdr({packet->data, std::size_t(packet->size)}, *movie.streams[streamIndex]->codecpar);
            if (packet->dts != AV_NOPTS_VALUE && packet->dts > time) break;
        }
        av_packet_unref(packet.get());
    }
    return false;
}

}  // namespace

std::string obstacleToCut(AVFormatContext& movie, const MovieOrigin& origin, const std::vector<FrameNumber>& frames)
{
    const auto codedOf = [&](FrameNumber frame) { return origin.coded.at(std::size_t(frame - origin.firstFrame)); };
    const FrameNumber first = frames.front();
    std::size_t least = codedOf(first).order, most = least;
    for (const FrameNumber frame : frames) {
        least = std::min(least, codedOf(frame).order);
        most = std::max(most, codedOf(frame).order);
    }
    if (least > 0 && !codedOf(first).isKey) return fmt::format("frame {} builds on frames before it", first);
    for (FrameNumber before = origin.firstFrame; least > 0 && before < first; ++before)
        if (codedOf(before).order > codedOf(first).order)
            return fmt::format("frame {} begins an open group of pictures: frame {} is coded after it", first, before);
    if (most - least + 1 != frames.size() || (least > 0 && codedOf(first).order != least))
        return fmt::format("frames up to {} and others are coded in turns; the run would have to end elsewhere",
                           frames.back());
    if (least > 0 && origin.codecId == AV_CODEC_ID_H264 &&
        !startsWithIdr(movie, origin.streamIndex, origin.times.at(std::size_t(first - origin.firstFrame)).start))
        return fmt::format("frame {} is not an IDR picture, so that frames after it may build on others before it",
                           first);
    return {};
}

}  // namespace virga::io
