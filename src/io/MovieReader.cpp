// Movies by frame number. Frame n is the n-th picture in the order of showing, whatever its codec's order.
//
// On opening all packets are listed (headers are read, nothing is decoded): their presentation times, sorted, are the
// frames. A frame is then reached by seeking to the last key picture that is not shown after it and decoding forward
// until the picture with its time stamp comes out, so that leading pictures of an open GOP, which need the GOP before,
// are never taken from a seek to their own GOP.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <set>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "io/ColorConversion.h"
#include "io/Ffv1Checksum.h"
#include "io/FrameSource.h"
#include "io/Libav.h"

namespace virga::io {

namespace fs = std::filesystem;
using namespace libav;

namespace {

/// How the coded picture is turned to be shown: first rows and columns are exchanged, then each axis is reversed.
struct Orientation {
    bool swap = false, reverseX = false, reverseY = false;
    bool isIdentity() const { return !swap && !reverseX && !reverseY; }
};

/// From the display matrix of the container (ISO 14496-12, 6.2.2). Only quarter turns and mirrors are honoured.
Orientation orientationOf(const AVStream* stream, const std::string& path)
{
    const std::uint8_t* data = av_stream_get_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
    if (data == nullptr) return {};
    std::int32_t m[9];
    std::memcpy(m, data, sizeof m);
    // shown x = m0 * x + m3 * y, shown y = m1 * x + m4 * y
    if (m[1] == 0 && m[3] == 0 && m[0] != 0 && m[4] != 0) return {false, m[0] < 0, m[4] < 0};
    if (m[0] == 0 && m[4] == 0 && m[1] != 0 && m[3] != 0) return {true, m[3] < 0, m[1] < 0};
    log::warning("{}: asks to be shown turned by {:.1f} degrees, which is no quarter turn; left as it is", path,
                 -av_display_rotation_get(m));
    return {};
}

/// Turns RGBA pixels. `shown` has the size after the turn.
void orient(const ImageF& coded, const Orientation& orientation, ImageF& shown)
{
    constexpr int tile = 16;
    parallelFor(0, (shown.height() + tile - 1) / tile, 1, [&](std::ptrdiff_t firstTile, std::ptrdiff_t lastTile) {
        const int top = int(firstTile) * tile, bottom = std::min(int(lastTile) * tile, shown.height());
        for (int left = 0; left < shown.width(); left += tile) {
            for (int y = top; y < bottom; ++y) {
                for (int x = left; x < std::min(left + tile, shown.width()); ++x) {
                    const int u = orientation.reverseX ? shown.width() - 1 - x : x;
                    const int v = orientation.reverseY ? shown.height() - 1 - y : y;
                    std::memcpy(shown.pixel(x, y), orientation.swap ? coded.pixel(v, u) : coded.pixel(u, v),
                                4 * sizeof(float));
                }
            }
        }
    });
}

struct Picture {
    std::int64_t time = 0;  // presentation, in the stream's time base
    std::int64_t decodeTime = 0;
    std::int64_t duration = 0;
    bool isKey = false;
    bool isDamaged = false;  // the packet is cut off or known to be wrong
};

constexpr std::int64_t nowhere = std::numeric_limits<std::int64_t>::min();

void checkIsFile(const std::string& path)
{
    std::error_code error;
    if (fs::is_directory(path, error))
        throw Error(ErrorCode::Input, "{}: is a folder; name a movie, an image or a pattern such as {}", path,
                    (fs::path(path) / "shot.%04d.exr").string());
    if (!fs::exists(path, error)) throw Error(ErrorCode::Input, "{}: does not exist", path);
    if (fs::is_regular_file(path, error) && fs::file_size(path, error) == 0)
        throw Error(ErrorCode::Input, "{}: is empty", path);
}

class MovieSource final : public FrameSource {
public:
    MovieSource(const std::string& path, const ReadOptions& options) : path_(path)
    {
        routeMessages();
        checkIsFile(path);
        openInput();
        listPictures();
        openDecoder();
        describe(options);
        restart();
    }

    const PlateInfo& info() const override { return info_; }
    const MovieOrigin* movie() const override { return &origin_; }

    PlateFrame load(FrameNumber number) override
    {
        const FrameNumber index = number - origin_.firstFrame;
        if (index < 0 || index >= FrameNumber(pictures_.size()))
            throw Error(ErrorCode::Input, "{}: has no frame {}; it has {}-{}", path_, number, info_.frames.front(),
                        info_.frames.back());
        PlateFrame frame;
        frame.number = number;
        frame.time_s = origin_.keepsTime ? double(origin_.times[std::size_t(index)].start - origin_.times[0].start) *
                                               origin_.timeBase.value()
                                         : double(index) / info_.fps;
        frame.pixels = convert(decode(std::size_t(index)), number);
        frame.extras = std::make_shared<FrameExtras>();
        return frame;
    }

private:
    // ---- opening

    void openInput()
    {
        AVFormatContext* context = nullptr;
        int result = avformat_open_input(&context, path_.c_str(), nullptr, nullptr);
        if (result < 0)
            throw Error(ErrorCode::Input, "{}: is not a movie that can be read ({})", path_, errorText(result));
        input_.reset(context);
        result = avformat_find_stream_info(context, nullptr);
        if (result < 0) throw Error(ErrorCode::Input, "{}: is damaged ({})", path_, errorText(result));
        streamIndex_ = av_find_best_stream(context, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
        if (streamIndex_ < 0 || (stream()->disposition & AV_DISPOSITION_ATTACHED_PIC) != 0)
            throw Error(ErrorCode::Input, "{}: holds no video", path_);
        if (stream()->codecpar->width <= 0 || stream()->codecpar->height <= 0)
            throw Error(ErrorCode::Input, "{}: its video has no size; the file is damaged or cut off", path_);
        for (unsigned i = 0; i < context->nb_streams; ++i)
            if (int(i) != streamIndex_) context->streams[i]->discard = AVDISCARD_ALL;
    }

    AVStream* stream() const { return input_->streams[streamIndex_]; }

    void listPictures()
    {
        const Packet packet = makePacket();
        const bool mayReorder = stream()->codecpar->video_delay > 0;
        while (av_read_frame(input_.get(), packet.get()) >= 0) {
            // Edit lists mark what is not shown; empty packets repeat the picture before.
            if (packet->stream_index == streamIndex_ && (packet->flags & AV_PKT_FLAG_DISCARD) == 0 &&
                packet->size > 0) {
                Picture picture;
                picture.decodeTime = packet->dts;
                picture.time = packet->pts != AV_NOPTS_VALUE || mayReorder ? packet->pts : packet->dts;
                picture.duration = packet->duration;
                picture.isKey = (packet->flags & AV_PKT_FLAG_KEY) != 0;
                picture.isDamaged = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
                if (picture.time == AV_NOPTS_VALUE) countsPictures_ = true;
                if (stream()->codecpar->codec_id == AV_CODEC_ID_FFV1 && pictures_.size() < 4)
                    hasChecksums_ = hasChecksums_ ||
                                    checkFfv1Packet(packet->data, std::size_t(packet->size)) != Ffv1Checksum::Absent;
                pictures_.push_back(picture);
            }
            av_packet_unref(packet.get());
        }
        if (pictures_.empty())
            throw Error(ErrorCode::Input, "{}: holds no picture; the file is damaged or cut off", path_);
        if (stream()->nb_frames > std::int64_t(pictures_.size()) && !hasEditList())
            log::warning("{}: is cut off: its header promises {} frames, {} are there", path_, stream()->nb_frames,
                         pictures_.size());
        if (countsPictures_) {
            // Raw streams without time stamps: pictures are counted, and reached from the start alone.
            for (std::size_t i = 0; i < pictures_.size(); ++i) pictures_[i].time = std::int64_t(i);
            return;
        }
        std::stable_sort(pictures_.begin(), pictures_.end(),
                         [](const Picture& a, const Picture& b) { return a.time < b.time; });
        // The second field of a picture may come in a packet of its own.
        const auto twins = std::unique(pictures_.begin(), pictures_.end(),
                                       [](const Picture& a, const Picture& b) { return a.time == b.time; });
        pictures_.erase(twins, pictures_.end());
    }

    /// Pictures that an edit list hides are counted in the header, but not shown.
    bool hasEditList() const
    {
        return std::strstr(input_->iformat->name, "mov") != nullptr && stream()->start_time != 0;
    }

    void openDecoder()
    {
        const AVCodecParameters* parameters = stream()->codecpar;
        const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
        if (codec == nullptr)
            throw Error(ErrorCode::Input, "{}: its video codec {} is not known here", path_,
                        avcodec_get_name(parameters->codec_id));
        decoder_.reset(avcodec_alloc_context3(codec));
        avcodec_parameters_to_context(decoder_.get(), parameters);
        decoder_->pkt_timebase = stream()->time_base;
        decoder_->thread_count = 0;
        decoder_->thread_type = FF_THREAD_FRAME | FF_THREAD_SLICE;
        // Checksums are looked at. Where every picture stands alone one that is wrong is better lost than shown;
        // elsewhere the decoder's own mark of a damaged picture decides (see checked), because explosions would cost
        // whole GOPs.
        decoder_->err_recognition |= AV_EF_CRCCHECK;
        const AVCodecDescriptor* descriptor = avcodec_descriptor_get(parameters->codec_id);
        if (descriptor != nullptr && (descriptor->props & (AV_CODEC_PROP_INTRA_ONLY | AV_CODEC_PROP_LOSSLESS)) != 0)
            if (parameters->codec_id != AV_CODEC_ID_H264 && parameters->codec_id != AV_CODEC_ID_HEVC)
                decoder_->err_recognition |= AV_EF_EXPLODE;
        const int result = avcodec_open2(decoder_.get(), codec, nullptr);
        if (result < 0)
            throw Error(ErrorCode::Input, "{}: its {} video cannot be decoded ({})", path_, codec->name,
                        errorText(result));
    }

    void describe(const ReadOptions& options)
    {
        const AVCodecParameters* parameters = stream()->codecpar;
        // The decoder may know better than the container, and some know only after the first picture.
        int pixelFormat = parameters->format;
        if (pixelFormat == AV_PIX_FMT_NONE) pixelFormat = decoder_->pix_fmt;
        const auto samples = samplesOf(pixelFormat);
        if (!samples)
            throw Error(ErrorCode::Input, "{}: its pixel format {} is not supported", path_,
                        pixelFormatName(pixelFormat));
        format_ = *samples;
        orientation_ = orientationOf(stream(), path_);

        info_.path = path_;
        info_.isMovie = true;
        info_.width = orientation_.swap ? parameters->height : parameters->width;
        info_.height = orientation_.swap ? parameters->width : parameters->height;
        info_.hasAlpha = format_.hasAlpha;
        info_.bitDepth = format_.bits;
        info_.format = fmt::format("{} {}", avcodec_get_name(parameters->codec_id), pixelFormatName(pixelFormat));

        origin_.path = path_;
        origin_.streamIndex = streamIndex_;
        origin_.timeBase = {stream()->time_base.num, stream()->time_base.den};
        origin_.codecId = parameters->codec_id;
        origin_.profile = parameters->profile;
        origin_.pixelFormat = withoutRangeName(pixelFormat);
        origin_.range = parameters->color_range;
        origin_.primaries = parameters->color_primaries;
        origin_.transfer = parameters->color_trc;
        origin_.matrix = parameters->color_space;
        origin_.chromaLocation = parameters->chroma_location;
        origin_.isTurned = orientation_.swap;
        origin_.timecode = findTimecode();
        if (origin_.range == AVCOL_RANGE_UNSPECIFIED)
            origin_.range = isFullRangeName(pixelFormat) || format_.family != PlanarFormat::Family::Yuv
                                ? AVCOL_RANGE_JPEG
                                : AVCOL_RANGE_MPEG;
        if (origin_.matrix == AVCOL_SPC_UNSPECIFIED || origin_.matrix == AVCOL_SPC_RESERVED)
            origin_.matrix = format_.family == PlanarFormat::Family::Rgb ? int(AVCOL_SPC_RGB)
                                                                         : guessedMatrix(info_.width, info_.height);
        coding_ = yuvCoding(origin_.matrix, origin_.range == AVCOL_RANGE_JPEG, path_);

        AVRational aspect = av_guess_sample_aspect_ratio(input_.get(), stream(), nullptr);
        if (aspect.num <= 0 || aspect.den <= 0) aspect = {1, 1};
        if (orientation_.swap) std::swap(aspect.num, aspect.den);
        origin_.pixelAspect = {aspect.num, aspect.den};
        info_.pixelAspect = av_q2d(aspect);

        describeTime(options);
        describeColor(options);
        if (parameters->field_order != AV_FIELD_UNKNOWN && parameters->field_order != AV_FIELD_PROGRESSIVE)
            log::warning("{}: is interlaced; the two fields of a frame are treated as one picture", path_);
    }

    std::string findTimecode() const
    {
        const auto of = [](const AVDictionary* metadata) -> std::string {
            const AVDictionaryEntry* entry = av_dict_get(metadata, "timecode", nullptr, 0);
            return entry != nullptr ? entry->value : "";
        };
        std::string timecode = of(stream()->metadata);
        if (timecode.empty()) timecode = of(input_->metadata);
        for (unsigned i = 0; timecode.empty() && i < input_->nb_streams; ++i)
            timecode = of(input_->streams[i]->metadata);
        return timecode;
    }

    void describeTime(const ReadOptions& options)
    {
        origin_.firstFrame = options.firstFrame.value_or(0);
        AVRational nominal = av_guess_frame_rate(input_.get(), stream(), nullptr);
        const AVRational average = stream()->avg_frame_rate;
        if (nominal.num <= 0 || nominal.den <= 0) nominal = average;
        if (nominal.num <= 0 || nominal.den <= 0) nominal = {24, 1};
        if (input_->start_time != AV_NOPTS_VALUE)
            origin_.containerStart =
                std::max<std::int64_t>(0, av_rescale_q(input_->start_time, AV_TIME_BASE_Q, stream()->time_base));
        const double timeBase = av_q2d(stream()->time_base), nominalStep = 1 / av_q2d(nominal) / timeBase;

        for (std::size_t i = 0; i < pictures_.size(); ++i) {
            info_.frames.push_back(origin_.firstFrame + FrameNumber(i));
            FrameTime time{pictures_[i].time, pictures_[i].duration};
            if (countsPictures_) time = {std::llround(double(i) * nominalStep), std::llround(nominalStep)};
            origin_.times.push_back(time);
        }
        for (std::size_t i = 0; i < pictures_.size(); ++i) {
            FrameTime& time = origin_.times[i];
            if (i + 1 < pictures_.size()) time.duration = origin_.times[i + 1].start - time.start;
            if (time.duration <= 0) time.duration = std::max<std::int64_t>(1, std::llround(nominalStep));
            // Containers round time stamps to their time base; more than that is a rate that varies.
            const double regular = double(origin_.times[0].start) + double(i) * nominalStep;
            if (std::fabs(double(time.start) - regular) > 1.01) origin_.isVariableRate = true;
        }
        const double seconds =
            double(origin_.times.back().start + origin_.times.back().duration - origin_.times.front().start) * timeBase;
        AVRational rate = nominal;
        if (origin_.isVariableRate && pictures_.size() > 1)
            rate = average.num > 0 && average.den > 0 ? average : av_d2q(double(pictures_.size()) / seconds, 1000000);
        if (options.fps) {
            rate = av_d2q(*options.fps, 1000000);
            origin_.keepsTime =
                !origin_.isVariableRate && std::fabs(*options.fps - av_q2d(nominal)) < 1e-4 * *options.fps;
        }
        origin_.frameRate = {rate.num, rate.den};
        info_.fps = options.fps.value_or(av_q2d(rate));
        info_.isVariableRate = origin_.isVariableRate;
    }

    void describeColor(const ReadOptions& options)
    {
        const AVCodecParameters* parameters = stream()->codecpar;
        toWorking_ = io::describeColor(
            info_, options,
            {colorClaimOf(parameters->color_trc, parameters->color_primaries, parameters->color_space)});
    }

    // ---- reaching a frame

    /// From the first packet. Opening anew is the one way that works for every container.
    void restart()
    {
        openInput();
        avcodec_flush_buffers(decoder_.get());
        last_.reset();
        lastTime_ = nowhere;
        counted_ = 0;
        drained_ = false;
    }

    /// To a key picture at or before `key`. False if the container cannot.
    bool seekTo(const Picture& key)
    {
        for (const std::int64_t time : {key.time, key.decodeTime}) {
            if (time == AV_NOPTS_VALUE) continue;
            if (av_seek_frame(input_.get(), streamIndex_, time, AVSEEK_FLAG_BACKWARD) < 0) continue;
            avcodec_flush_buffers(decoder_.get());
            last_.reset();
            lastTime_ = nowhere;
            drained_ = false;
            // Where did it land? The packet is decoded, not lost.
            Packet packet = makePacket();
            for (;;) {
                if (av_read_frame(input_.get(), packet.get()) < 0) break;
                if (packet->stream_index == streamIndex_) {
                    if (packet->dts != AV_NOPTS_VALUE && key.decodeTime != AV_NOPTS_VALUE &&
                        packet->dts > key.decodeTime)
                        break;
                    send(*packet);
                    return true;
                }
                av_packet_unref(packet.get());
            }
        }
        return false;
    }

    /// The last key picture that is shown at `index` or before, `earlier` keys before that one; nothing before the
    /// first.
    const Picture* keyFor(std::size_t index, int earlier) const
    {
        for (std::size_t i = index + 1; i-- > 0;)
            if (pictures_[i].isKey && earlier-- == 0) return &pictures_[i];
        return nullptr;
    }

    const AVFrame& decode(std::size_t index)
    {
        const std::int64_t target = pictures_[index].time;
        const FrameNumber number = origin_.firstFrame + FrameNumber(index);
        if (pictures_[index].isDamaged)
            throw Error(ErrorCode::Input, "{}: frame {} is damaged or cut off", path_, number);

        if (last_ && lastTime_ == target) return checked(index);
        // Decoding on is right when no key picture lies between, or when it is only a few pictures.
        const Picture* key = keyFor(index, 0);
        const bool isNear =
            lastTime_ != nowhere && lastTime_ < target &&
            (index < 8 || pictures_[index - 8].time <= lastTime_ || (key != nullptr && key->time <= lastTime_));
        const bool isFresh = lastTime_ == nowhere && counted_ == 0 && index < 8;
        if (!drained_ && (isNear || isFresh) && decodeUntil(target)) return checked(index);
        for (int earlier = 0; earlier < 2; ++earlier) {
            key = countsPictures_ ? nullptr : keyFor(index, earlier);
            const bool fromStart = key == nullptr || !seekTo(*key);
            if (fromStart) restart();
            if (decodeUntil(target)) return checked(index);
            if (fromStart) break;
        }
        throw Error(ErrorCode::Input, "{}: frame {} is damaged and cannot be decoded", path_, number);
    }

    /// last_, unless the decoder had to make parts of it up.
    const AVFrame& checked(std::size_t index) const
    {
        if (!wrongTimes_.contains(lastTime_) && last_->decode_error_flags == 0 &&
            (last_->flags & AV_FRAME_FLAG_CORRUPT) == 0)
            return *last_;
        const auto nextKey = std::find_if(pictures_.begin() + std::ptrdiff_t(index) + 1, pictures_.end(),
                                          [](const Picture& picture) { return picture.isKey; });
        const FrameNumber number = origin_.firstFrame + FrameNumber(index);
        const FrameNumber lastTouched = origin_.firstFrame + (nextKey - pictures_.begin()) - 1;
        if (lastTouched > number)
            throw Error(ErrorCode::Input, "{}: frame {} is damaged; frames up to {} build on it and may show it", path_,
                        number, lastTouched);
        throw Error(ErrorCode::Input, "{}: frame {} is damaged", path_, number);
    }

    /// Decodes on until the picture shown at `target` is in last_; false if it does not come.
    bool decodeUntil(std::int64_t target)
    {
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
                continue;
            }
            lastTime_ = countsPictures_ ? counted_ : frame->best_effort_timestamp;
            ++counted_;
            last_ = std::move(frame);
            if (lastTime_ == target) return true;
            if (lastTime_ > target) return false;
        }
        return false;
    }

    /// A packet into the decoder. What it cannot use shows as a picture that does not come.
    void send(const AVPacket& packet)
    {
        if (hasChecksums_ && checkFfv1Packet(packet.data, std::size_t(packet.size)) != Ffv1Checksum::Right)
            wrongTimes_.insert(packet.pts != AV_NOPTS_VALUE ? packet.pts : packet.dts);
        avcodec_send_packet(decoder_.get(), &packet);
    }

    /// One packet into the decoder, or the sign that there are no more.
    void feed()
    {
        const Packet packet = makePacket();
        while (av_read_frame(input_.get(), packet.get()) >= 0) {
            if (packet->stream_index == streamIndex_ && packet->size > 0) {
                send(*packet);
                return;
            }
            av_packet_unref(packet.get());
        }
        avcodec_send_packet(decoder_.get(), nullptr);
    }

    // ---- pixels

    ImageF convert(const AVFrame& decoded, FrameNumber number)
    {
        const int codedWidth = orientation_.swap ? info_.height : info_.width;
        const int codedHeight = orientation_.swap ? info_.width : info_.height;
        if (decoded.width != codedWidth || decoded.height != codedHeight)
            throw Error(ErrorCode::Input, "{}: frame {} is {}x{}, the movie began with {}x{}", path_, number,
                        decoded.width, decoded.height, codedWidth, codedHeight);
        if (samplesOf(decoded.format) != format_)
            throw Error(ErrorCode::Input, "{}: frame {} is {}, the movie began with {}", path_, number,
                        pixelFormatName(decoded.format), pixelFormatName(origin_.pixelFormat));
        PlanarPicture picture = planesOf(decoded);
        if (!isPlanar(decoded.format)) {
            if (!unpacked_) unpacked_ = std::make_unique<PlanarBuffer>(format_, codedWidth, codedHeight);
            picture = unpacked_->picture();
            unpack(decoded, format_, picture);
        }
        ImageF coded(codedWidth, codedHeight, 4);
        planarToLinear(format_, coding_, asConst(picture), *toWorking_, coded);
        if (orientation_.isIdentity()) return coded;
        ImageF shown(info_.width, info_.height, 4);
        orient(coded, orientation_, shown);
        return shown;
    }

    std::string path_;
    PlateInfo info_;
    MovieOrigin origin_;
    Input input_;
    int streamIndex_ = -1;
    Codec decoder_;
    std::vector<Picture> pictures_;      // in order of showing
    bool hasChecksums_ = false;          // FFV1 packets carry them
    std::set<std::int64_t> wrongTimes_;  // presentation times of packets whose checksum is wrong
    bool countsPictures_ = false;        // no time stamps: Picture::time is a count

    Orientation orientation_;
    PlanarFormat format_;
    YuvCoding coding_;
    std::unique_ptr<PlanarBuffer> unpacked_;  // for formats that are not planar
    std::shared_ptr<const ColorTransform> toWorking_;

    Frame last_;                       // the picture that the decoder gave last
    std::int64_t lastTime_ = nowhere;  // its presentation time
    std::int64_t counted_ = 0;         // pictures since restart()
    bool drained_ = false;             // the decoder has been told that there are no more packets
};

}  // namespace

std::unique_ptr<FrameSource> openMovie(const std::string& path, const ReadOptions& options)
{
    return std::make_unique<MovieSource>(path, options);
}

}  // namespace virga::io
