// Movies out: pictures encoded on a thread of their own, everything else copied beside them.
//
// Time: frames that come in ascending order keep the plate's time stamps, holes included, so that the sound stays in
// step; a plate of images has none, and its frames follow one another at its rate. Where the order is not ascending the
// frames run on at the plate's average rate and the sound ends.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mathematics.h>
}

#include <algorithm>
#include <map>

#include "core/Error.h"
#include "core/Log.h"
#include "io/BackgroundQueue.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "io/Libav.h"
#include "io/MovieEncoder.h"
#include "io/MovieMetadata.h"
#include "io/MovieOutput.h"
#include "io/MovieRows.h"
#include "io/StreamCopy.h"
#include "io/Writers.h"

namespace virga::io {

using namespace libav;

namespace {

constexpr int rowAlignment = 32;  // [bytes]

class MovieWriter final : public PlateWriter {
public:
    MovieWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin, const WriteOptions& options)
        : plate_(plate), origin_(origin), timeline_(options.timeline), output_(path, options.movie.container)
    {
        if (options.layers)
            throw Error(ErrorCode::InvalidArgument, "{}: only EXR files hold layers; name the output .exr", path);
        if (output_.is("yuv4mpegpipe") && origin != nullptr && origin->keepsTime && origin->isVariableRate)
            throw Error(ErrorCode::InvalidArgument,
                        "{}: y4m has one rate, the plate's varies; .mkv, .mov and .mp4 keep its time stamps, --fps "
                        "gives it one",
                        path);
        if (plate.isStill) log::detail("{}: a movie of one frame", path);
        chooseTimeBase();
        if (origin_ != nullptr) movie_ = openPlateMovie(origin_->path);
        // Another colour space is another picture than the one that these numbers were measured on.
        HdrMetadata hdr;
        if (movie_ && options.outputColorspace.empty()) hdr = readHdrMetadata(*movie_, origin_->streamIndex);
        AVFormatContext& context = output_.context();
        encoder_ = openEncoder(output_.name(), context, {plate_, origin_, hdr}, options, timeBase_, format_);
        timeBase_ = {encoder_->time_base.num, encoder_->time_base.den};
        toCode_ = plate.colors->transform(plate.workingColorspace, format_.colorspace);

        stream_ = avformat_new_stream(&context, nullptr);
        if (stream_ == nullptr) throw std::bad_alloc();
        avcodec_parameters_from_context(stream_->codecpar, encoder_.get());
        stream_->time_base = encoder_->time_base;
        stream_->avg_frame_rate = encoder_->framerate;
        stream_->sample_aspect_ratio = encoder_->sample_aspect_ratio;
        if (output_.isIsoMedia() && encoder_->codec_id == AV_CODEC_ID_HEVC)
            stream_->codecpar->codec_tag = MKTAG('h', 'v', 'c', '1');
        addHdrMetadata(hdr, *stream_);
        if (movie_) {
            copyFileMetadata(*movie_, context);
            copyStreamMetadata(*movie_->streams[origin_->streamIndex], *stream_);
            stream_->disposition = movie_->streams[origin_->streamIndex]->disposition;
        }
        if (origin_ != nullptr && !origin_->keepsTime) {
            log::warning("{}: the rate is not the plate's, so its sound is left out", path);
        } else if (origin_ != nullptr && context.oformat->audio_codec != AV_CODEC_ID_NONE) {
            others_ = std::make_unique<StreamCopy>(*origin_, output_, StreamCopy::Pictures::LeftOut);
        }
    }

    /// Makes the file; everything else is checked by then.
    void open() { output_.open(); }

    bool takesCodes() const override
    {
        return origin_ != nullptr && withoutRangeName(format_.pixelFormat) == origin_->pixelFormat &&
               format_.coding == origin_->coding && format_.colorspace == plate_.colorspace;
    }

    SharedChroma sharedChroma() const override
    {
        if (format_.planar.family != PlanarFormat::Family::Yuv) return {};
        return {format_.planar.chromaShiftX, format_.planar.chromaShiftY};
    }

    std::shared_ptr<RowSink> canvas() override
    {
        if (!isPlanar(format_.pixelFormat)) return nullptr;
        return std::make_shared<EncoderRows>(emptyPicture(), PlanesOfLight{format_.planar, format_.coding, toCode_});
    }

    void write(RenderedFrame frame) override
    {
        auto shared = std::make_shared<RenderedFrame>(std::move(frame));
        queue_.push([this, shared] { encode(*shared); }, bytesOf(*shared));
    }

    void finish() override
    {
        queue_.drain();
        if (!lastTime_) {
            log::warning("{}: no frame was written, so there is no movie", output_.name());
            return;
        }
        output_.check(avcodec_send_frame(encoder_.get(), nullptr));
        takePackets();
        const bool isToTheEnd = lastFrame_ == plate_.frames.back();
        if (others_) {
            if (isToTheEnd)
                others_->copyAll();
            else
                others_->copyUntil(plateEnd_);
        }
        if (output_.takesLateChapters()) addChapters(isToTheEnd ? std::nullopt : std::optional(plateEnd_));
        output_.finish();
    }

private:
    /// `end`: the plate's time at which the last frame ends; nothing: all of it.
    void addChapters(std::optional<std::int64_t> end)
    {
        if (!movie_ || !keepsTime()) return;
        const double tick = av_q2d(plateTimeBase());
        copyChapters(*movie_, output_.context(), double(zero_) * tick,
                     end ? std::optional(double(*end) * tick) : std::nullopt);
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

    /// The start timecode counts on by as many frames as come before the first one written.
    void setTimecode(FrameNumber first)
    {
        if (origin_ == nullptr || origin_->timecode.empty()) return;
        const auto text = timecodeAfter(origin_->timecode, origin_->frameRate, first - origin_->firstFrame);
        if (!text) {
            log::warning("{}: the plate's timecode {} does not fit its rate and is left out", output_.name(),
                         origin_->timecode);
            return;
        }
        // MP4, MOV and MXF make a track of the stream's; Matroska has one word for the whole file.
        AVDictionary** metadata = output_.isMatroska() ? &output_.context().metadata : &stream_->metadata;
        av_dict_set(metadata, "timecode", text->c_str(), 0);
    }

    void begin(FrameNumber first)
    {
        setTimecode(first);
        if (keepsTime()) {
            const bool fromStart = first == plate_.frames.front();
            if (!fromStart) zero_ = timeOf(first).start;
            if (others_) others_->begin(zero_, fromStart ? std::nullopt : std::optional(zero_));
        }
        if (!output_.takesLateChapters()) addChapters({});
        // Time stamps come back as they were.
        output_.begin(timeBase_.den >= 1000 && timeBase_.num == 1 ? timeBase_.den : 0);
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
                output_.name(), frame, lastFrame_);
            isOutOfOrder_ = true;
            others_.reset();
        }
        // Frames of a sequence keep their distance, so that a hole in it is one in time.
        const bool isSequence = origin_ == nullptr && !plate_.isStill;
        if (!lastTime_) firstFrame_ = frame;
        const std::int64_t placed = isSequence ? (frame - firstFrame_) * step : 0;
        const std::int64_t time = lastTime_ ? std::max(*lastTime_ + step, placed) : 0;
        durations_[time] = step;
        return time;
    }

    AVRational plateTimeBase() const { return {origin_->timeBase.num, origin_->timeBase.den}; }

    Frame emptyPicture() const
    {
        Frame frame = makeFrame();
        frame->format = format_.pixelFormat;
        frame->width = plate_.width;
        frame->height = plate_.height;
        if (av_frame_get_buffer(frame.get(), 0) < 0) throw std::bad_alloc();
        return frame;
    }

    Frame codedPicture(const RenderedFrame& rendered)
    {
        if (rendered.beauty.width() != plate_.width || rendered.beauty.height() != plate_.height ||
            rendered.beauty.channels() != 4)
            throw Error(ErrorCode::Internal, "frame {} is {}x{} with {} channels where the plate is {}x{}",
                        rendered.number, rendered.beauty.width(), rendered.beauty.height(), rendered.beauty.channels(),
                        plate_.width, plate_.height);
        const StageSpan span(timeline_, "encoder", "convert", rendered.number);
        Frame frame = emptyPicture();
        if (isPlanar(format_.pixelFormat)) {
            linearToPlanar(format_.planar, format_.coding, rendered.beauty, *toCode_, planesOf(*frame));
        } else {
            if (!unpacked_) unpacked_ = std::make_unique<PlanarBuffer>(format_.planar, plate_.width, plate_.height);
            linearToPlanar(format_.planar, format_.coding, rendered.beauty, *toCode_, unpacked_->picture());
            pack(asConst(unpacked_->picture()), format_.planar, *frame);
        }
        return frame;
    }

    /// The decoder's samples with nothing of what it said about them. Encoders read rows in steps that cropping at the
    /// left, or a decoder's own memory, may not be aligned to; those are copied.
    Frame samePicture(const AVFrame& decoded) const
    {
        bool isAligned = true;
        for (int plane = 0; plane < AV_NUM_DATA_POINTERS && decoded.data[plane] != nullptr; ++plane)
            isAligned = isAligned && reinterpret_cast<std::uintptr_t>(decoded.data[plane]) % rowAlignment == 0 &&
                        decoded.linesize[plane] % rowAlignment == 0;
        if (!isAligned) {
            Frame frame = emptyPicture();
            frame->format = decoded.format;
            if (av_frame_copy(frame.get(), &decoded) < 0) throw std::bad_alloc();
            return frame;
        }
        Frame frame = makeFrame();
        frame->width = decoded.width;
        frame->height = decoded.height;
        for (int plane = 0; plane < AV_NUM_DATA_POINTERS; ++plane) {
            frame->data[plane] = decoded.data[plane];
            frame->linesize[plane] = decoded.linesize[plane];
            if (decoded.buf[plane] == nullptr) continue;
            frame->buf[plane] = av_buffer_ref(decoded.buf[plane]);
            if (frame->buf[plane] == nullptr) throw std::bad_alloc();
        }
        return frame;
    }

    void encode(const RenderedFrame& rendered)
    {
        const StageSpan span(timeline_, "encoder", "encode", rendered.number);
        if (!lastTime_) begin(rendered.number);
        const bool isCoded = rendered.beauty.empty() && rendered.extras && rendered.extras->codes;
        const Frame frame = rendered.canvas ? static_cast<EncoderRows&>(*rendered.canvas).take()  // made by canvas()
                            : isCoded       ? samePicture(*rendered.extras->codes)
                                            : codedPicture(rendered);
        frame->format = format_.pixelFormat;  // the same samples may have another name: yuvj420p
        frame->color_range = encoder_->color_range;
        frame->color_primaries = encoder_->color_primaries;
        frame->color_trc = encoder_->color_trc;
        frame->colorspace = encoder_->colorspace;
        frame->chroma_location = encoder_->chroma_sample_location;
        frame->sample_aspect_ratio = encoder_->sample_aspect_ratio;
        frame->interlaced_frame = format_.isInterlaced;
        frame->top_field_first = format_.isTopFirst;
        frame->pts = nextTime(rendered.number);
        lastTime_ = frame->pts;
        lastFrame_ = rendered.number;
        sentTimes_.push_back(frame->pts);
        output_.check(avcodec_send_frame(encoder_.get(), frame.get()));
        takePackets();
        if (others_) others_->copyUntil(plateEnd_);
    }

    /// x265 gives whatever is in memory as the decoding time if the movie has fewer frames than it reorders. The n-th
    /// packet is due when the frame is shown that comes as many before the n-th as are reordered.
    void mendDecodingTime(AVPacket& packet)
    {
        const auto n = std::ptrdiff_t(packets_++), delay = std::ptrdiff_t(encoder_->has_b_frames);
        const std::int64_t step =
            std::max<std::int64_t>(1, av_rescale_q(1, av_inv_q(encoder_->framerate), encoder_->time_base));
        constexpr int mostReordered = 256;
        const bool makesSense = packet.dts <= packet.pts && packet.dts > packet.pts - mostReordered * step &&
                                (n == 0 || packet.dts > lastDecoding_);
        if (!makesSense)
            packet.dts = std::min(packet.pts, n >= delay ? sentTimes_.at(std::size_t(n - delay))
                                                         : sentTimes_.front() - (delay - n) * step);
        lastDecoding_ = packet.dts;
    }

    void takePackets()
    {
        for (;;) {
            const Packet packet = makePacket();
            const int result = avcodec_receive_packet(encoder_.get(), packet.get());
            if (result == AVERROR(EAGAIN) || result == AVERROR_EOF) return;
            output_.check(result);
            if (const auto duration = durations_.find(packet->pts); duration != durations_.end()) {
                packet->duration = duration->second;
                durations_.erase(duration);
            }
            mendDecodingTime(*packet);
            packet->stream_index = stream_->index;
            av_packet_rescale_ts(packet.get(), encoder_->time_base, stream_->time_base);
            output_.write(*packet);
        }
    }

    const PlateInfo plate_;
    const MovieOrigin* origin_;
    Timeline* timeline_;
    MovieOutput output_;
    Input movie_;  // the plate's, for what it says of itself
    Codec encoder_;
    AVStream* stream_ = nullptr;  // of output_
    std::unique_ptr<StreamCopy> others_;
    MovieFormat format_;
    std::unique_ptr<PlanarBuffer> unpacked_;  // for formats that are not planar
    std::shared_ptr<const ColorTransform> toCode_;

    Rational timeBase_;
    std::int64_t zero_ = 0;      // the plate's time that is 0 in the result
    std::int64_t plateEnd_ = 0;  // the plate's time at which the last frame written ends
    std::optional<std::int64_t> lastTime_;
    FrameNumber lastFrame_ = 0, firstFrame_ = 0;
    bool isOutOfOrder_ = false;
    std::map<std::int64_t, std::int64_t> durations_;  // of frames in the encoder, by their time
    std::vector<std::int64_t> sentTimes_;             // of all frames, for decoding times
    std::size_t packets_ = 0;
    std::int64_t lastDecoding_ = 0;
    BackgroundQueue queue_{1, 2, mostBytesToWrite};  // last, so that its thread ends before what it uses
};

}  // namespace

bool isMovieName(const std::string& path)
{
    if (path == standardOutput) return true;
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
    auto writer = std::make_unique<MovieWriter>(path, plate, origin, options);
    writer->open();
    return writer;
}

void checkMovieWriter(const std::string& path, const PlateInfo& plate, const MovieOrigin* origin,
                      const WriteOptions& options)
{
    routeMessages();
    const MovieWriter neverOpened(path, plate, origin, options);
}

}  // namespace virga::io
