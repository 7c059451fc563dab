#include "io/MovieEncoder.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ColorConversion.h"
#include "io/Writers.h"

namespace virga::io {

using namespace libav;

namespace {

/// Encoders worth naming to a user, best first.
constexpr const char* usualEncoders[] = {
    "libx264", "libx265", "prores_ks", "dnxhd",   "ffv1",  "libvpx-vp9", "libsvtav1", "libaom-av1", "mjpeg", "cfhd",
    "mpeg4",   "utvideo", "huffyuv",   "ffvhuff", "qtrle", "mpeg2video", "rawvideo",  "libx264rgb", "png"};

bool fits(const AVOutputFormat& container, const AVCodec& encoder)
{
    return avformat_query_codec(&container, encoder.id, FF_COMPLIANCE_NORMAL) == 1;
}

std::string encodersFor(const AVOutputFormat& container)
{
    std::vector<std::string> names;
    for (const char* name : usualEncoders)
        if (const AVCodec* encoder = avcodec_find_encoder_by_name(name);
            encoder != nullptr && fits(container, *encoder))
            names.emplace_back(name);
    return fmt::format("{}", fmt::join(names, ", "));
}

const AVCodec* chooseEncoder(const std::string& path, const AVOutputFormat& container, const MovieOrigin* origin,
                             const WriteOptions& options)
{
    if (!options.codec.empty()) {
        const AVCodec* encoder = avcodec_find_encoder_by_name(options.codec.c_str());
        if (encoder == nullptr || encoder->type != AVMEDIA_TYPE_VIDEO)
            throw Error(ErrorCode::InvalidArgument, "codec '{}' is not known; for {} there are {}", options.codec, path,
                        encodersFor(container));
        if (!fits(container, *encoder))
            throw Error(ErrorCode::InvalidArgument, "codec '{}' cannot be put into {}; there are {}", options.codec,
                        path, encodersFor(container));
        return encoder;
    }
    // A plate that was kept without loss, or for editing, goes on like that where the container can hold it.
    std::vector<const char*> candidates;
    switch (origin != nullptr ? AVCodecID(origin->codecId) : AV_CODEC_ID_NONE) {
        case AV_CODEC_ID_PRORES: candidates = {"prores_ks"}; break;
        case AV_CODEC_ID_DNXHD: candidates = {"dnxhd"}; break;
        case AV_CODEC_ID_FFV1: candidates = {"ffv1"}; break;
        case AV_CODEC_ID_HUFFYUV:
        case AV_CODEC_ID_FFVHUFF: candidates = {"ffvhuff", "ffv1"}; break;
        case AV_CODEC_ID_UTVIDEO: candidates = {"utvideo"}; break;
        case AV_CODEC_ID_RAWVIDEO: candidates = {"rawvideo"}; break;
        case AV_CODEC_ID_QTRLE: candidates = {"qtrle"}; break;
        case AV_CODEC_ID_MJPEG: candidates = {"mjpeg"}; break;
        case AV_CODEC_ID_HEVC: candidates = {"libx265"}; break;
        default: break;
    }
    candidates.insert(candidates.end(), {"libx264", "libvpx-vp9"});
    const bool isAvi = std::strcmp(container.name, "avi") == 0;
    for (const char* name : candidates) {
        // AVI takes H.264 by name only: it has no place for the order of pictures.
        if (isAvi && std::strcmp(name, "libx264") == 0) continue;
        if (const AVCodec* encoder = avcodec_find_encoder_by_name(name);
            encoder != nullptr && fits(container, *encoder))
            return encoder;
    }
    if (const AVCodec* encoder = avcodec_find_encoder(container.video_codec)) return encoder;
    throw Error(ErrorCode::Output,
                "{}: no encoder is there for {} files; name another kind of output, such as .mp4 or .mkv", path,
                container.name);
}

bool is(const AVCodec& encoder, const char* name) { return std::strcmp(encoder.name, name) == 0; }

/// The samples that the plate has, or what suits the encoder if the plate is images.
PlanarFormat wantedFormat(const PlateInfo& plate, const MovieOrigin* origin, const AVCodec& encoder)
{
    using Family = PlanarFormat::Family;
    PlanarFormat format;
    if (origin != nullptr) {
        format = *samplesOf(origin->pixelFormat);
        // Turned by a quarter, 4:2:2 would share chroma between rows instead; 4:4:4 keeps all of it.
        if (origin->isTurned && format.chromaShiftX != format.chromaShiftY)
            format.chromaShiftX = format.chromaShiftY = 0;
        return format;
    }
    format.hasAlpha = plate.hasAlpha;
    if (is(encoder, "ffv1") || is(encoder, "utvideo") || is(encoder, "qtrle") || is(encoder, "png") ||
        is(encoder, "libx264rgb") || is(encoder, "rawvideo") || is(encoder, "cfhd")) {
        format.family = Family::Rgb;
        format.bits = plate.isFloat ? 16 : plate.bitDepth;
    } else if (is(encoder, "prores_ks") || is(encoder, "prores") || is(encoder, "dnxhd")) {
        format.bits = 10;
        format.chromaShiftX = plate.hasAlpha ? 0 : 1;
    } else {
        format.chromaShiftX = format.chromaShiftY = 1;  // what every player shows
    }
    return format;
}

/// The encoder's format that is nearest to the wanted one.
int choosePixelFormat(const std::string& path, const AVCodec& encoder, PlanarFormat wanted, const PlateInfo& plate,
                      int plateFormat)
{
    const bool evenOnly = is(encoder, "libx264") || is(encoder, "libx265");
    const auto splitsEvenly = [&](const PlanarFormat& format) {
        return plate.width % (1 << format.chromaShiftX) == 0 && plate.height % (1 << format.chromaShiftY) == 0;
    };
    if (evenOnly && !splitsEvenly(wanted)) {
        wanted.chromaShiftX = wanted.chromaShiftY = 0;
        log::info("{}: {} cannot share colour between pixels of a picture of {}x{}; written as 4:4:4", path,
                  encoder.name, plate.width, plate.height);
    }
    const int wantedFormat = pixelFormatOf(wanted);
    std::vector<AVPixelFormat> usable;
    for (const AVPixelFormat* p = encoder.pix_fmts; p != nullptr && *p != AV_PIX_FMT_NONE; ++p) {
        const auto format = samplesOf(*p);
        if (format && (!evenOnly || splitsEvenly(*format))) usable.push_back(*p);
    }
    if (encoder.pix_fmts == nullptr) {
        if (plateFormat != AV_PIX_FMT_NONE && samplesOf(plateFormat) == wanted) return plateFormat;
        if (wantedFormat != AV_PIX_FMT_NONE) return wantedFormat;
    }
    if (usable.empty())
        throw Error(ErrorCode::InvalidArgument, "codec '{}' takes none of the pixel formats that can be written",
                    encoder.name);
    // The plate's own layout, then planes, then any other with the same samples.
    for (const AVPixelFormat p : usable)
        if (p == plateFormat && samplesOf(p) == wanted) return p;
    for (const AVPixelFormat p : usable)
        if (isPlanar(p) && samplesOf(p) == wanted) return p;
    for (const AVPixelFormat p : usable)
        if (samplesOf(p) == wanted) return p;

    // The nearest by what would be lost: colour first, then resolution of colour, bits and alpha; then by what is
    // spent.
    const auto cost = [&](AVPixelFormat p) {
        const PlanarFormat format = *samplesOf(p);
        double cost = 0;
        if (format.family == PlanarFormat::Family::Grey && wanted.family != PlanarFormat::Family::Grey) cost += 1000;
        if (wanted.hasAlpha && !format.hasAlpha) cost += 300;
        cost += 100 * std::max(0, wanted.bits - format.bits) / 8.0 + std::max(0, format.bits - wanted.bits) / 8.0;
        const int wantedShift = wanted.chromaShiftX + wanted.chromaShiftY,
                  shift = format.chromaShiftX + format.chromaShiftY;
        cost += 40 * std::max(0, shift - wantedShift) + 2 * std::max(0, wantedShift - shift);
        if (format.family != wanted.family) cost += 20;
        if (format.hasAlpha && !wanted.hasAlpha) cost += 3;
        return cost;
    };
    const AVPixelFormat best =
        *std::min_element(usable.begin(), usable.end(), [&](auto a, auto b) { return cost(a) < cost(b); });
    log::info("{}: {} has no {}; written as {}", path, encoder.name,
              wantedFormat == AV_PIX_FMT_NONE ? "such pixels" : pixelFormatName(wantedFormat), pixelFormatName(best));
    if (wanted.hasAlpha && !samplesOf(best)->hasAlpha)
        log::warning("{}: {} has no alpha; it is left out and the picture stands over black", path, encoder.name);
    return best;
}

void setOption(AVCodecContext& codec, const char* name, const std::string& value)
{
    av_opt_set(&codec, name, value.c_str(), AV_OPT_SEARCH_CHILDREN);
}

struct Clock {
    AVRational timeBase, rate;
};

/// The clock as the encoder takes it; most take any. MPEG-1 and MPEG-2 number their few rates (ISO 13818-2, table 6-4)
/// and count frames; MPEG-4 part 2 keeps ticks a second in 16 bits (ISO 14496-2, vop_time_increment_resolution).
Clock clockFor(const std::string& path, const AVCodec& encoder, const MovieOrigin* origin, Rational timeBase,
               Rational frameRate)
{
    const Clock wanted{{timeBase.num, timeBase.den}, {frameRate.num, frameRate.den}};
    if (encoder.supported_framerates != nullptr) {
        const bool isVariable = origin != nullptr && origin->keepsTime && origin->isVariableRate;
        const auto isNear = [&](const AVRational& rate) {
            return std::fabs(av_q2d(rate) / av_q2d(wanted.rate) - 1) < 1e-5;
        };
        for (const AVRational* rate = encoder.supported_framerates; rate->num != 0; ++rate)
            if (!isVariable && isNear(*rate)) return {av_inv_q(*rate), *rate};
        throw Error(ErrorCode::InvalidArgument,
                    "codec '{}' takes constant rates such as 24, 25, 29.97 and 30 frames a second alone, and for {} it "
                    "is {}{:.4g}; choose another codec, such as libx264, or set such a rate with --fps",
                    encoder.name, path, isVariable ? "a varying one of about " : "", av_q2d(wanted.rate));
    }
    constexpr int most = 65535, fineEnough = 10000;
    if (encoder.id != AV_CODEC_ID_MPEG4 || timeBase.den <= most) return wanted;
    Clock clock = wanted;
    if (timeBase.num == 1) {
        // A part of the plate's ticks, such as 45000 for 90000, so that many times stay exact.
        int parts = timeBase.den / most + 1;
        while (timeBase.den % parts != 0 && timeBase.den / parts >= fineEnough) ++parts;
        clock.timeBase.den = timeBase.den % parts == 0 ? timeBase.den / parts : 60000;
    } else {
        av_reduce(&clock.timeBase.num, &clock.timeBase.den, timeBase.num, timeBase.den, most);
    }
    return clock;
}

/// Settings that make an intermediate: hardly to be told from the plate, at a speed that a render can live with.
void tune(AVCodecContext& codec, const AVCodec& encoder, const MovieOrigin* origin, const PlanarFormat& format,
          std::optional<double> quality)
{
    const auto fixedQuantiser = [&](double value) {
        codec.flags |= AV_CODEC_FLAG_QSCALE;
        codec.global_quality = int(std::lround(FF_QP2LAMBDA * value));
    };
    if (is(encoder, "libx264") || is(encoder, "libx264rgb") || is(encoder, "libx265")) {
        setOption(codec, "crf", fmt::format("{:g}", quality.value_or(17)));
        setOption(codec, "preset", "medium");
        if (is(encoder, "libx265")) setOption(codec, "x265-params", "log-level=none");
    } else if (is(encoder, "ffv1")) {
        codec.gop_size = 1;  // every picture alone, for seeking
        // Version 3 cuts the picture into slices, for threads, and must cut between whole chroma samples.
        const bool cutsEvenly =
            codec.width % (2 << format.chromaShiftX) == 0 && codec.height % (2 << format.chromaShiftY) == 0;
        codec.level = cutsEvenly ? 3 : 1;
        if (cutsEvenly) {
            codec.slices = 4;
            setOption(codec, "slicecrc", "1");
        }
    } else if (is(encoder, "prores_ks")) {
        const bool is4444 = format.chromaShiftX == 0;
        const bool plateProfile = origin != nullptr && origin->codecId == AV_CODEC_ID_PRORES && origin->profile >= 0 &&
                                  (origin->profile >= FF_PROFILE_PRORES_4444) == is4444;
        codec.profile = plateProfile ? origin->profile : is4444 ? FF_PROFILE_PRORES_4444 : FF_PROFILE_PRORES_HQ;
        setOption(codec, "profile", std::to_string(codec.profile));
        setOption(codec, "vendor", "apl0");  // what editors look for
        if (quality) fixedQuantiser(*quality);
    } else if (is(encoder, "dnxhd")) {
        setOption(codec, "profile",
                  format.chromaShiftX == 0 ? "dnxhr_444"
                  : format.bits > 8        ? "dnxhr_hqx"
                                           : "dnxhr_hq");
    } else if (is(encoder, "libvpx-vp9") || is(encoder, "libaom-av1") || is(encoder, "libsvtav1")) {
        codec.bit_rate = 0;
        setOption(codec, "crf", fmt::format("{:g}", std::round(quality.value_or(20))));
        if (is(encoder, "libvpx-vp9")) {
            setOption(codec, "row-mt", "1");
            setOption(codec, "cpu-used", "4");
        } else if (is(encoder, "libaom-av1")) {
            setOption(codec, "cpu-used", "6");
        }
    } else if (is(encoder, "mjpeg") || is(encoder, "mpeg4") || is(encoder, "mpeg2video")) {
        codec.qmin = 1;
        fixedQuantiser(quality.value_or(2));
    } else if (quality) {
        if (av_opt_find(&codec, "crf", nullptr, 0, AV_OPT_SEARCH_CHILDREN) != nullptr)
            setOption(codec, "crf", fmt::format("{:g}", *quality));
        else
            fixedQuantiser(*quality);
    }
}

}  // namespace

Rational movieFrameRate(const PlateInfo& plate, const MovieOrigin* origin)
{
    if (origin != nullptr) return origin->frameRate;
    const AVRational rate = av_d2q(plate.fps, 100000);
    return {rate.num, rate.den};
}

Codec openEncoder(const std::string& path, const AVFormatContext& output, const PlateInfo& plate,
                  const MovieOrigin* origin, const WriteOptions& options, Rational timeBase, MovieFormat& format)
{
    const AVCodec* encoder = chooseEncoder(path, *output.oformat, origin, options);
    format.pixelFormat = choosePixelFormat(path, *encoder, wantedFormat(plate, origin, *encoder), plate,
                                           origin != nullptr ? origin->pixelFormat : int(AV_PIX_FMT_NONE));
    format.planar = *samplesOf(format.pixelFormat);
    format.colorspace = options.outputColorspace.empty() ? defaultOutputColorspace(plate, false)
                                                         : plate.colors->resolve(options.outputColorspace);

    // As tagged in the plate where the colours are the plate's, so that the codes mean what they meant there.
    ColorTags tags = tagsOf(plate.colors->equivalent(format.colorspace));
    const bool isYuv = format.planar.family == PlanarFormat::Family::Yuv;
    bool isFullRange = !isYuv;
    if (origin != nullptr && format.colorspace == plate.colorspace) {
        tags.transfer = origin->transfer;
        tags.primaries = origin->primaries;
        if (origin->matrix != AVCOL_SPC_RGB) tags.matrix = origin->matrix;
        const bool wasYuv = samplesOf(origin->pixelFormat)->family == PlanarFormat::Family::Yuv;
        if (isYuv == wasYuv) isFullRange = origin->range == AVCOL_RANGE_JPEG;
    }
    if (tags.matrix == AVCOL_SPC_UNSPECIFIED) tags.matrix = guessedMatrix(plate.width, plate.height);
    if (is(*encoder, "mjpeg")) {  // JFIF knows nothing else
        isFullRange = true;
        tags.matrix = AVCOL_SPC_BT470BG;
    }
    if (format.planar.family == PlanarFormat::Family::Rgb) tags.matrix = AVCOL_SPC_RGB;
    format.coding = yuvCoding(tags.matrix, isFullRange, path);

    Codec codec(avcodec_alloc_context3(encoder));
    if (!codec) throw std::bad_alloc();
    const Clock clock = clockFor(path, *encoder, origin, timeBase, movieFrameRate(plate, origin));
    codec->width = plate.width;
    codec->height = plate.height;
    codec->pix_fmt = AVPixelFormat(format.pixelFormat);
    codec->time_base = clock.timeBase;
    codec->framerate = clock.rate;
    codec->sample_aspect_ratio = origin != nullptr ? AVRational{origin->pixelAspect.num, origin->pixelAspect.den}
                                                   : av_d2q(plate.pixelAspect, 1000);
    codec->color_range = isFullRange ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
    codec->color_primaries = AVColorPrimaries(tags.primaries);
    codec->color_trc = AVColorTransferCharacteristic(tags.transfer);
    codec->colorspace = AVColorSpace(tags.matrix);
    if (origin != nullptr) codec->chroma_sample_location = AVChromaLocation(origin->chromaLocation);
    codec->bits_per_raw_sample = format.planar.bits;
    codec->thread_count = 0;
    codec->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
    if ((output.oformat->flags & AVFMT_GLOBALHEADER) != 0) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    tune(*codec, *encoder, origin, format.planar, options.quality);

    const int result = avcodec_open2(codec.get(), encoder, nullptr);
    if (result < 0)
        throw Error(ErrorCode::InvalidArgument, "codec '{}' cannot write {}x{} {} into {} ({})", encoder->name,
                    plate.width, plate.height, pixelFormatName(format.pixelFormat), path, errorText(result));
    return codec;
}

}  // namespace virga::io
