// Movies out: pictures encoded on a thread of their own, sound copied beside them.
//
// Time: frames that come in ascending order keep the plate's time stamps, holes included, so that the sound stays in
// step; a plate of images has none, and its frames follow one another at its rate. Where the order is not ascending the
// frames run on at the plate's average rate and the sound ends.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mathematics.h>
#include <libavutil/timecode.h>
}

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "core/Error.h"
#include "core/Log.h"
#include "io/AtomicFile.h"
#include "io/BackgroundQueue.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "io/Libav.h"
#include "io/MovieEncoder.h"
#include "io/SoundCopy.h"
#include "io/Writers.h"

namespace virga::io {

using namespace libav;

namespace {

class MovieWriter final : public PlateWriter {
public:
    MovieWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin, const WriteOptions& options)
        : plate_(plate), origin_(origin), file_(path)
    {
        if (options.layers)
            throw Error(ErrorCode::InvalidArgument, "{}: only EXR files hold layers; name the output .exr", path);
        if (plate.isStill) log::detail("{}: a movie of one frame", path);
        makeContainer();
        chooseTimeBase();
        encoder_ = openEncoder(path, *output_, plate_, origin_, options, timeBase_, format_);
        timeBase_ = {encoder_->time_base.num, encoder_->time_base.den};
        toCode_ = plate.colors->transform(plate.workingColorspace, format_.colorspace);

        stream_ = avformat_new_stream(output_.get(), nullptr);
        if (stream_ == nullptr) throw std::bad_alloc();
        avcodec_parameters_from_context(stream_->codecpar, encoder_.get());
        stream_->time_base = encoder_->time_base;
        stream_->avg_frame_rate = encoder_->framerate;
        stream_->sample_aspect_ratio = encoder_->sample_aspect_ratio;
        const bool isIsoMedia = is("mp4") || is("mov") || is("ipod");
        if (isIsoMedia && encoder_->codec_id == AV_CODEC_ID_HEVC)
            stream_->codecpar->codec_tag = MKTAG('h', 'v', 'c', '1');
        if (origin_ != nullptr) copyMetadata();
        if (origin_ != nullptr && !origin_->keepsTime) {
            log::warning("{}: the rate is not the plate's, so its sound is left out", path);
        } else if (origin_ != nullptr) {
            sound_ = std::make_unique<SoundCopy>(*origin_, *output_, path);
        }
        const int result = avio_open(&output_->pb, file_.temporaryPath().c_str(), AVIO_FLAG_WRITE);
        if (result < 0) throw Error(ErrorCode::Output, "{}: cannot be written ({})", path, errorText(result));
    }

    void write(RenderedFrame frame) override
    {
        auto shared = std::make_shared<RenderedFrame>(std::move(frame));
        queue_.push([this, shared] { encode(*shared); });
    }

    void finish() override
    {
        queue_.drain();
        if (!lastTime_) {
            log::warning("{}: no frame was written, so there is no movie", file_.finalPath());
            return;
        }
        check(avcodec_send_frame(encoder_.get(), nullptr));
        takePackets();
        if (sound_) {
            if (lastFrame_ == plate_.frames.back())
                sound_->copyAll();
            else
                sound_->copyUntil(plateEnd_);
        }
        check(av_write_trailer(output_.get()));
        avio_flush(output_->pb);
        check(output_->pb->error);
        check(avio_closep(&output_->pb));
        file_.commit();
    }

private:
    bool is(const char* container) const { return std::strcmp(output_->oformat->name, container) == 0; }

    void check(int result) const
    {
        if (result < 0)
            throw Error(ErrorCode::Output, "{}: cannot be written ({})", file_.finalPath(), errorText(result));
    }

    void makeContainer()
    {
        AVFormatContext* context = nullptr;
        if (avformat_alloc_output_context2(&context, nullptr, nullptr, file_.finalPath().c_str()) < 0)
            throw Error(ErrorCode::Output,
                        "{}: is no movie format that can be written; there are .mp4, .mov, .mkv, .webm, .avi",
                        file_.finalPath());
        output_.reset(context);
    }

    /// Regular rates count frames; the plate's own clock is kept where its frames are not regular.
    void chooseTimeBase()
    {
        const Rational rate = movieFrameRate(plate_, origin_);
        timeBase_ = {rate.den, rate.num};
        if (origin_ == nullptr || !origin_->keepsTime) return;
        zero_ = std::min(origin_->containerStart, origin_->times[0].start);
        if (origin_->isVariableRate || origin_->times[0].start != zero_) timeBase_ = origin_->timeBase;
    }

    void copyMetadata()
    {
        AVFormatContext* context = nullptr;
        if (avformat_open_input(&context, origin_->path.c_str(), nullptr, nullptr) < 0) return;
        const Input input(context);
        // What the container and the encoder write themselves, and what is no longer true.
        static const std::set<std::string> own = {"major_brand", "minor_version", "compatible_brands",
                                                  "encoder",     "timecode",      "duration",
                                                  "rotate",      "vendor_id",     "creation_time"};
        const auto copy = [](const AVDictionary* from, AVDictionary** to) {
            const AVDictionaryEntry* entry = nullptr;
            while ((entry = av_dict_get(from, "", entry, AV_DICT_IGNORE_SUFFIX)) != nullptr) {
                std::string key = entry->key;
                std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return std::tolower(c); });
                if (!own.contains(key) && !key.starts_with("_statistics") && key != "bps" &&
                    !key.starts_with("number_of_"))
                    av_dict_set(to, entry->key, entry->value, 0);
            }
        };
        copy(context->metadata, &output_->metadata);
        if (const auto* created = av_dict_get(context->metadata, "creation_time", nullptr, 0))
            av_dict_set(&output_->metadata, "creation_time", created->value, 0);
        if (origin_->streamIndex < int(context->nb_streams)) {
            const AVStream* from = context->streams[origin_->streamIndex];
            copy(from->metadata, &stream_->metadata);
            stream_->disposition = from->disposition;
        }
    }

    /// The start timecode counts on by as many frames as come before the first one written.
    void setTimecode(FrameNumber first)
    {
        if (origin_ == nullptr || origin_->timecode.empty()) return;
        AVTimecode timecode;
        const AVRational rate{origin_->frameRate.num, origin_->frameRate.den};
        std::string text = origin_->timecode;
        if (av_timecode_init_from_string(&timecode, rate, text.c_str(), nullptr) >= 0) {
            char buffer[AV_TIMECODE_STR_SIZE];
            text = av_timecode_make_string(&timecode, buffer, int(first - origin_->firstFrame));
        } else if (first != origin_->firstFrame) {
            log::warning("{}: the plate's timecode {} does not fit its rate and is left out", file_.finalPath(), text);
            return;
        }
        av_dict_set(&stream_->metadata, "timecode", text.c_str(), 0);
    }

    void begin(FrameNumber first)
    {
        setTimecode(first);
        if (keepsTime()) {
            const bool fromStart = first == plate_.frames.front();
            if (!fromStart) zero_ = timeOf(first).start;
            if (sound_) sound_->begin(zero_, fromStart ? std::nullopt : std::optional(zero_));
        }
        AVDictionary* options = nullptr;
        if (is("mp4") || is("mov") || is("ipod")) {
            av_dict_set(&options, "movflags", "+write_colr", 0);
            // Time stamps come back as they were.
            if (timeBase_.den >= 1000 && timeBase_.num == 1)
                av_dict_set_int(&options, "video_track_timescale", timeBase_.den, 0);
        }
        const int result = avformat_write_header(output_.get(), &options);
        av_dict_free(&options);
        check(result);
    }

    bool keepsTime() const { return origin_ != nullptr && origin_->keepsTime && !isOutOfOrder_; }

    const FrameTime& timeOf(FrameNumber frame) const
    {
        return origin_->times.at(std::size_t(frame - origin_->firstFrame));
    }

    /// Time stamp of a frame in timeBase_.
    std::int64_t nextTime(FrameNumber frame)
    {
        const std::int64_t step =
            std::max<std::int64_t>(1, av_rescale_q(1, av_inv_q(encoder_->framerate), encoder_->time_base));
        if (keepsTime()) {
            const std::int64_t time = av_rescale_q(timeOf(frame).start - zero_, plateTimeBase(), encoder_->time_base);
            if (!lastTime_ || time > *lastTime_) {
                plateEnd_ = timeOf(frame).start + timeOf(frame).duration;
                durations_[time] = std::max<std::int64_t>(
                    1, av_rescale_q(timeOf(frame).duration, plateTimeBase(), encoder_->time_base));
                return time;
            }
            log::warning(
                "{}: frame {} does not follow frame {}; from here on there is no sound and the rate is the average",
                file_.finalPath(), frame, lastFrame_);
            isOutOfOrder_ = true;
            sound_.reset();
        }
        const std::int64_t time = lastTime_ ? *lastTime_ + step : 0;
        durations_[time] = step;
        return time;
    }

    AVRational plateTimeBase() const { return {origin_->timeBase.num, origin_->timeBase.den}; }

    void encode(const RenderedFrame& rendered)
    {
        if (rendered.beauty.width() != plate_.width || rendered.beauty.height() != plate_.height ||
            rendered.beauty.channels() != 4)
            throw Error(ErrorCode::Internal, "frame {} is {}x{} with {} channels where the plate is {}x{}",
                        rendered.number, rendered.beauty.width(), rendered.beauty.height(), rendered.beauty.channels(),
                        plate_.width, plate_.height);
        if (!lastTime_) begin(rendered.number);
        const Frame frame = makeFrame();
        frame->format = format_.pixelFormat;
        frame->width = plate_.width;
        frame->height = plate_.height;
        frame->color_range = encoder_->color_range;
        frame->color_primaries = encoder_->color_primaries;
        frame->color_trc = encoder_->color_trc;
        frame->colorspace = encoder_->colorspace;
        frame->chroma_location = encoder_->chroma_sample_location;
        frame->sample_aspect_ratio = encoder_->sample_aspect_ratio;
        if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
        if (isPlanar(format_.pixelFormat)) {
            linearToPlanar(format_.planar, format_.coding, rendered.beauty, *toCode_, planesOf(*frame));
        } else {
            if (!unpacked_) unpacked_ = std::make_unique<PlanarBuffer>(format_.planar, plate_.width, plate_.height);
            linearToPlanar(format_.planar, format_.coding, rendered.beauty, *toCode_, unpacked_->picture());
            pack(asConst(unpacked_->picture()), format_.planar, *frame);
        }

        frame->pts = nextTime(rendered.number);
        lastTime_ = frame->pts;
        lastFrame_ = rendered.number;
        check(avcodec_send_frame(encoder_.get(), frame.get()));
        takePackets();
        if (sound_) sound_->copyUntil(plateEnd_);
    }

    void takePackets()
    {
        for (;;) {
            const Packet packet = makePacket();
            const int result = avcodec_receive_packet(encoder_.get(), packet.get());
            if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
            check(result);
            if (const auto duration = durations_.find(packet->pts); duration != durations_.end()) {
                packet->duration = duration->second;
                durations_.erase(duration);
            }
            packet->stream_index = stream_->index;
            av_packet_rescale_ts(packet.get(), encoder_->time_base, stream_->time_base);
            check(av_interleaved_write_frame(output_.get(), packet.get()));
        }
    }

    const PlateInfo plate_;
    const MovieOrigin* origin_;
    AtomicFile file_;
    Output output_;
    Codec encoder_;
    AVStream* stream_ = nullptr;  // of output_
    std::unique_ptr<SoundCopy> sound_;
    MovieFormat format_;
    std::unique_ptr<PlanarBuffer> unpacked_;  // for formats that are not planar
    std::shared_ptr<const ColorTransform> toCode_;

    Rational timeBase_;
    std::int64_t zero_ = 0;      // the plate's time that is 0 in the result
    std::int64_t plateEnd_ = 0;  // the plate's time at which the last frame written ends
    std::optional<std::int64_t> lastTime_;
    FrameNumber lastFrame_ = 0;
    bool isOutOfOrder_ = false;
    std::map<std::int64_t, std::int64_t> durations_;  // of frames in the encoder, by their time
    BackgroundQueue queue_{1, 2};                     // last, so that its thread ends before what it uses
};

}  // namespace

bool isMovieName(const std::string& path)
{
    // Image formats come first: FFmpeg, too, writes .png and .jpg, one file a frame.
    if (isFramePattern(path) || isImageName(path)) return false;
    const AVOutputFormat* container = av_guess_format(nullptr, path.c_str(), nullptr);
    if (container == nullptr || container->video_codec == AV_CODEC_ID_NONE) return false;
    // Sound that may carry a cover (.mp3, .flac, .aiff), and what is not one file (streams, images by number).
    const bool isSoundWithCover =
        container->audio_codec != AV_CODEC_ID_NONE && container->video_codec == AV_CODEC_ID_PNG;
    return !isSoundWithCover && (container->flags & AVFMT_NOFILE) == 0;
}

std::unique_ptr<PlateWriter> createMovieWriter(const std::string& path, const PlateInfo& plate,
                                               const MovieOrigin* origin, const WriteOptions& options)
{
    routeMessages();
    return std::make_unique<MovieWriter>(path, plate, origin, options);
}

}  // namespace virga::io
