#include "io/MovieDecoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <string_view>
#include <utility>

#include "core/Error.h"
#include "io/Ffv1Checksum.h"

namespace virga::io {

using namespace libav;

namespace {

constexpr std::size_t keptPictures = 3;  // a picture and its neighbours, for deinterlacing

/// FFmpeg's own VP8 and VP9 decoders leave out the alpha that Matroska and WebM keep beside the picture; libvpx reads
/// it.
const AVCodec* findDecoder(const AVStream& stream)
{
    const AVCodecID id = stream.codecpar->codec_id;
    const AVDictionaryEntry* alpha = av_dict_get(stream.metadata, "alpha_mode", nullptr, 0);
    const AVCodec* decoder = nullptr;
    if (alpha != nullptr && std::string_view(alpha->value) == "1") {
        if (id == AV_CODEC_ID_VP8) decoder = avcodec_find_decoder_by_name("libvpx");
        if (id == AV_CODEC_ID_VP9) decoder = avcodec_find_decoder_by_name("libvpx-vp9");
    }
    return decoder != nullptr ? decoder : avcodec_find_decoder(id);
}

/// Where every picture stands alone one that is wrong is better lost than shown. Elsewhere the decoder's own mark of a
/// damaged picture decides (MovieDecoder::checked), because a refused packet would cost whole GOPs.
bool refusesWrongPackets(AVCodecID codec)
{
    if (codec == AV_CODEC_ID_H264 || codec == AV_CODEC_ID_HEVC) return false;
    const AVCodecDescriptor* descriptor = avcodec_descriptor_get(codec);
    return descriptor != nullptr && (descriptor->props & (AV_CODEC_PROP_INTRA_ONLY | AV_CODEC_PROP_LOSSLESS)) != 0;
}

/// Whether what the decoder says is wrong with a packet is wrong with its picture. Other decoders complain of
/// references that they have not seen after a seek, and mark what is damaged.
bool complaintsCount(AVCodecID codec)
{
    const AVCodecDescriptor* descriptor = avcodec_descriptor_get(codec);
    return codec == AV_CODEC_ID_HEVC || (descriptor != nullptr && (descriptor->props & AV_CODEC_PROP_INTRA_ONLY) != 0);
}

std::int64_t timeOf(const AVPacket& packet) { return packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts; }

}  // namespace

MovieDecoder::MovieDecoder(MovieInput& input, const PictureIndex& index, FrameNumber firstFrame)
    : input_(input), index_(index), firstFrame_(firstFrame)
{
    open();
    restart();
}

void MovieDecoder::open()
{
    const AVCodecParameters* parameters = input_.stream()->codecpar;
    const AVCodec* codec = findDecoder(*input_.stream());
    if (codec == nullptr)
        throw Error(ErrorCode::Input, "{}: its video codec {} is not known here", input_.name(),
                    avcodec_get_name(parameters->codec_id));
    decoder_.reset(avcodec_alloc_context3(codec));
    avcodec_parameters_to_context(decoder_.get(), parameters);
    decoder_->pkt_timebase = input_.stream()->time_base;
    decoder_->thread_count = 0;
    decoder_->thread_type = FF_THREAD_FRAME | FF_THREAD_SLICE;
    // Else columns are cropped at the left by multiples of the memory alignment only, and the others stay.
    decoder_->flags |= AV_CODEC_FLAG_UNALIGNED;
    decoder_->err_recognition |= AV_EF_CRCCHECK;
    if (refusesWrongPackets(parameters->codec_id)) decoder_->err_recognition |= AV_EF_EXPLODE;
    if (complaintsCount(parameters->codec_id)) decoder_->opaque = &complaints_;
    const int result = avcodec_open2(decoder_.get(), codec, nullptr);
    if (result < 0)
        throw Error(ErrorCode::Input, "{}: its {} video cannot be decoded ({})", input_.name(), codec->name,
                    errorText(result));
}

Frame MovieDecoder::picture(std::size_t index)
{
    if (index_.pictures[index].isDamaged)
        throw Error(ErrorCode::Input, "{}: frame {} is damaged or cut off", input_.name(),
                    firstFrame_ + FrameNumber(index));
    if (kept(index_.pictures[index].time) == nullptr && !reach(index))
        throw Error(ErrorCode::Input, "{}: frame {} is damaged and cannot be decoded", input_.name(),
                    firstFrame_ + FrameNumber(index));
    Frame reference(av_frame_clone(&checked(index)));
    if (!reference) throw std::bad_alloc();
    return reference;
}

const AVFrame* MovieDecoder::kept(std::int64_t time) const
{
    for (const Decoded& decoded : last_)
        if (decoded.time == time) return decoded.frame.get();
    return nullptr;
}

/// Decodes until the picture is the newest in last_; false if it does not come.
bool MovieDecoder::reach(std::size_t index)
{
    // An H.264 picture of nal_ref_idc 0 is built on by none: on the way to another it need not be decoded. (HEVC's are
    // by higher sublayers.)
    skips_ = decoder_->codec_id == AV_CODEC_ID_H264 && !index_.countsPictures;
    const bool isReached = go(index);
    if (isReached || !std::exchange(skips_, false)) return isReached;
    restart();  // in case that it was the gaps
    return go(index);
}

bool MovieDecoder::go(std::size_t index)
{
    const std::vector<Picture>& pictures = index_.pictures;
    const std::int64_t target = pictures[index].time;
    // Decoding on is right when no key picture lies between, or when it is only a few pictures.
    const Picture* key = index_.keyFor(index, 0);
    const bool isNear =
        lastTime_ != nowhere && lastTime_ < target &&
        (index < 8 || pictures[index - 8].time <= lastTime_ || (key != nullptr && key->time <= lastTime_));
    const bool isFresh = lastTime_ == nowhere && counted_ == 0 && index < 8;
    if (!drained_ && (isNear || isFresh) && decodeUntil(target)) return true;
    for (int earlier = 0; earlier < 2; ++earlier) {
        key = index_.countsPictures ? nullptr : index_.keyFor(index, earlier);
        const bool fromStart = key == nullptr || !seekTo(*key, target);
        if (fromStart) restart();
        if (decodeUntil(target)) return true;
        if (fromStart) break;
    }
    return false;
}

/// The kept picture, unless the decoder had to make parts of it up.
const AVFrame& MovieDecoder::checked(std::size_t index) const
{
    const std::int64_t time = index_.pictures[index].time;
    const AVFrame& frame = *kept(time);
    if (!complaints_.has(time) && frame.decode_error_flags == 0 && (frame.flags & AV_FRAME_FLAG_CORRUPT) == 0)
        return frame;
    const FrameNumber number = firstFrame_ + FrameNumber(index);
    const FrameNumber lastTouched = firstFrame_ + FrameNumber(index_.lastBuiltOn(index));
    if (lastTouched > number)
        throw Error(ErrorCode::Input, "{}: frame {} is damaged; frames up to {} build on it and may show it",
                    input_.name(), number, lastTouched);
    throw Error(ErrorCode::Input, "{}: frame {} is damaged", input_.name(), number);
}

void MovieDecoder::forget()
{
    avcodec_flush_buffers(decoder_.get());
    last_.clear();
    lastTime_ = nowhere;
    drained_ = false;
}

/// To the first packet. Opening anew is the one way that works for every container.
void MovieDecoder::restart()
{
    input_.reopen();
    forget();
    counted_ = 0;
}

/// To a key picture at or before `key`. False if the container cannot.
bool MovieDecoder::seekTo(const Picture& key, std::int64_t target)
{
    target_ = target;
    for (const std::int64_t time : {key.time, key.decodeTime}) {
        if (time == AV_NOPTS_VALUE) continue;
        if (av_seek_frame(input_.container(), input_.streamIndex(), time, AVSEEK_FLAG_BACKWARD) < 0) continue;
        forget();
        // Where did it land? The packet is decoded, not lost.
        const Packet packet = makePacket();
        if (!input_.read(*packet)) continue;
        if (packet->dts != AV_NOPTS_VALUE && key.decodeTime != AV_NOPTS_VALUE && packet->dts > key.decodeTime) continue;
        send(*packet);
        return true;
    }
    return false;
}

/// Decodes on until the picture shown at `target` is the newest; false if it does not come.
bool MovieDecoder::decodeUntil(std::int64_t target)
{
    target_ = target;
    for (int failures = 0; failures < 1000;) {
        Frame frame = makeFrame();
        const int result = avcodec_receive_frame(decoder_.get(), frame.get());
        if (result == AVERROR(EAGAIN)) {
            feed();
            continue;
        }
        if (result == AVERROR_EOF) {
            drained_ = true;
            return false;
        }
        if (result < 0) {  // one picture is lost; what comes out next is still right
            ++failures;
            ++counted_;
            continue;
        }
        lastTime_ = index_.countsPictures ? counted_ : frame->best_effort_timestamp;
        ++counted_;
        last_.push_back({lastTime_, std::move(frame)});
        if (last_.size() > keptPictures) last_.pop_front();
        if (lastTime_ == target) return true;
        if (lastTime_ > target) return false;
    }
    return false;
}

/// A packet into the decoder. What it cannot use shows as a picture that does not come.
void MovieDecoder::send(const AVPacket& packet)
{
    // What was said of it before may have been for want of what it builds on.
    complaints_.forget(timeOf(packet));
    if (index_.hasChecksums && checkFfv1Packet(packet.data, std::size_t(packet.size)) != Ffv1Checksum::Right)
        complaints_.add(timeOf(packet));
    decoder_->reordered_opaque = timeOf(packet);
    decoder_->skip_frame = skips_ && timeOf(packet) < target_ ? AVDISCARD_NONREF : AVDISCARD_DEFAULT;
    if (avcodec_send_packet(decoder_.get(), &packet) < 0) ++counted_;  // a picture that will not come is one as well
}

/// One packet into the decoder, or the sign that there are no more.
void MovieDecoder::feed()
{
    const Packet packet = makePacket();
    if (input_.read(*packet))
        send(*packet);
    else
        avcodec_send_packet(decoder_.get(), nullptr);
}

}  // namespace virga::io
