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
#include <sstream>

#include "core/Error.h"
#include "core/Words.h"
#include "io/ColorConversion.h"
#include "io/EncoderChoice.h"
#include "io/Writers.h"

namespace virga::io {

using namespace libav;

namespace {

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

/// "qp=0,bf=2" as pairs. Throws Error(InvalidArgument) for what is no pair.
std::vector<std::pair<std::string, std::string>> pairsOf(const std::string& text)
{
    std::vector<std::pair<std::string, std::string>> pairs;
    std::istringstream words(text);
    for (std::string word; std::getline(words, word, ',');) {
        const std::size_t equals = word.find('=');
        if (equals == 0 || equals == std::string::npos)
            throw Error(ErrorCode::InvalidArgument,
                        "--codec-options '{}': must be name=value, several separated by commas, such as qp=0,bf=2",
                        text);
        pairs.emplace_back(word.substr(0, equals), word.substr(equals + 1));
    }
    return pairs;
}

bool hasAny(const std::vector<std::pair<std::string, std::string>>& pairs, std::initializer_list<const char*> names)
{
    return std::any_of(pairs.begin(), pairs.end(), [&](const auto& pair) {
        return std::find(names.begin(), names.end(), pair.first) != names.end();
    });
}

/// Names of the encoder's own options, for a sentence.
std::vector<std::string> optionNames(const AVCodec& encoder)
{
    std::vector<std::string> names;
    if (encoder.priv_class == nullptr) return names;
    for (const AVOption* option = nullptr; (option = av_opt_next(&encoder.priv_class, option)) != nullptr;)
        if (option->type != AV_OPT_TYPE_CONST) names.emplace_back(option->name);
    return names;
}

/// What an option takes, for a sentence: its words, else its range.
std::string valuesOf(const AVCodec& encoder, const AVOption& option)
{
    std::vector<std::string> words;
    if (option.unit != nullptr && encoder.priv_class != nullptr)
        for (const AVOption* other = nullptr; (other = av_opt_next(&encoder.priv_class, other)) != nullptr;)
            if (other->type == AV_OPT_TYPE_CONST && other->unit != nullptr &&
                std::strcmp(other->unit, option.unit) == 0)
                words.emplace_back(other->name);
    if (!words.empty()) return fmt::format("{}", fmt::join(words, ", "));
    return option.max > option.min ? fmt::format("{:g} to {:g}", option.min, option.max) : "another kind of value";
}

/// What x264 and x265 take for options that FFmpeg hands on as text. They would refuse others in a line of their own.
std::vector<std::string> libraryWords(const AVCodec& encoder, const std::string& option)
{
    const bool isX264 = isEncoder(encoder, "libx264") || isEncoder(encoder, "libx264rgb");
    if (!isX264 && !isEncoder(encoder, "libx265")) return {};
    if (option == "preset")
        return {"ultrafast", "superfast", "veryfast", "faster",   "fast",
                "medium",    "slow",      "slower",   "veryslow", "placebo"};
    if (option != "tune") return {};
    if (isX264) return {"film", "animation", "grain", "stillimage", "psnr", "ssim", "fastdecode", "zerolatency"};
    return {"psnr", "ssim", "grain", "fastdecode", "zerolatency", "animation"};
}

void setAskedOption(AVCodecContext& codec, const AVCodec& encoder, const char* flag, const std::string& name,
                    const std::string& value)
{
    const AVOption* option = av_opt_find(&codec, name.c_str(), nullptr, 0, AV_OPT_SEARCH_CHILDREN);
    if (option == nullptr || option->type == AV_OPT_TYPE_CONST) {
        const std::vector<std::string> names = optionNames(encoder);
        const std::string nearest = nearestWord(name, names), all = fmt::format("{}", fmt::join(names, ", "));
        throw Error(ErrorCode::InvalidArgument, "{} '{}': codec '{}' has no such option; {}", flag, name, encoder.name,
                    names.empty()      ? "it has none of its own"
                    : !nearest.empty() ? fmt::format("did you mean '{}'?", nearest)
                    : all.size() <= 300
                        ? "it has " + all
                        : fmt::format("'ffmpeg -h encoder={}' lists its {}", encoder.name, names.size()));
    }
    if (const auto words = libraryWords(encoder, name);
        !words.empty() && std::find(words.begin(), words.end(), value) == words.end())
        throw Error(ErrorCode::InvalidArgument, "{} '{}': codec '{}' takes {}", flag,
                    name == "preset" ? value : name + "=" + value, encoder.name, fmt::join(words, ", "));
    if (av_opt_set(&codec, name.c_str(), value.c_str(), AV_OPT_SEARCH_CHILDREN) < 0)
        throw Error(ErrorCode::InvalidArgument, "{} '{}={}': codec '{}' takes {}", flag, name, value, encoder.name,
                    valuesOf(encoder, *option));
}

/// Settings that make an intermediate: hardly to be told from the plate, at a speed that a render can live with.
/// ratesItself: the user's options say how many bits are spent.
void tune(AVCodecContext& codec, const AVCodec& encoder, const MovieSubject& subject, const PlanarFormat& format,
          std::optional<double> quality, bool ratesItself)
{
    const auto is = [&](const char* name) { return isEncoder(encoder, name); };
    const auto fixedQuantiser = [&](double value) {
        codec.flags |= AV_CODEC_FLAG_QSCALE;
        codec.global_quality = int(std::lround(FF_QP2LAMBDA * value));
    };
    const auto rateFactor = [&](double standard) {
        if (!ratesItself || quality) setOption(codec, "crf", fmt::format("{:g}", quality.value_or(standard)));
    };
    const AVCodecDescriptor* descriptor = avcodec_descriptor_get(encoder.id);
    // A group of pictures is what a killed render loses, and what a seek decodes: two seconds.
    if (descriptor != nullptr && (descriptor->props & AV_CODEC_PROP_INTRA_ONLY) == 0)
        codec.gop_size = std::max(1, int(std::lround(2 * av_q2d(codec.framerate))));
    if (is("libx264") || is("libx264rgb") || is("libx265")) {
        rateFactor(17);
        setOption(codec, "preset", "medium");
    } else if (is("ffv1")) {
        codec.gop_size = 1;  // every picture alone, for seeking
        // Version 3 cuts the picture into slices, for threads, and must cut between whole chroma samples.
        const bool cutsEvenly =
            codec.width % (2 << format.chromaShiftX) == 0 && codec.height % (2 << format.chromaShiftY) == 0;
        codec.level = cutsEvenly ? 3 : 1;
        if (cutsEvenly) {
            codec.slices = 4;
            setOption(codec, "slicecrc", "1");
        }
    } else if (is("prores_ks")) {
        const bool is4444 = format.chromaShiftX == 0;
        const MovieOrigin* origin = subject.origin;
        const bool plateProfile = origin != nullptr && origin->codecId == AV_CODEC_ID_PRORES && origin->profile >= 0 &&
                                  (origin->profile >= FF_PROFILE_PRORES_4444) == is4444;
        codec.profile = plateProfile ? origin->profile : is4444 ? FF_PROFILE_PRORES_4444 : FF_PROFILE_PRORES_HQ;
        setOption(codec, "profile", std::to_string(codec.profile));
        setOption(codec, "vendor", "apl0");  // what editors look for
        if (quality) fixedQuantiser(*quality);
    } else if (is("dnxhd")) {
        setOption(codec, "profile",
                  format.chromaShiftX == 0 ? "dnxhr_444"
                  : format.bits > 8        ? "dnxhr_hqx"
                                           : "dnxhr_hq");
    } else if (is("libvpx-vp9") || is("libaom-av1") || is("libsvtav1")) {
        codec.bit_rate = 0;
        rateFactor(20);
        if (is("libvpx-vp9")) {
            setOption(codec, "row-mt", "1");
            setOption(codec, "cpu-used", "4");
        } else if (is("libaom-av1")) {
            setOption(codec, "cpu-used", "6");
        }
    } else if (is("mjpeg") || is("mpeg4") || is("mpeg2video")) {
        codec.qmin = 1;
        if (!ratesItself || quality) fixedQuantiser(quality.value_or(2));
    } else if (quality) {
        if (av_opt_find(&codec, "crf", nullptr, 0, AV_OPT_SEARCH_CHILDREN) != nullptr)
            rateFactor(*quality);
        else
            fixedQuantiser(*quality);
    }
}

/// x265's and SVT-AV1's own parameters: what FFmpeg has no name for, then the user's, which win.
void setLibraryParameters(AVCodecContext& codec, const AVCodec& encoder, const MovieSubject& subject,
                          const std::string& asked)
{
    std::vector<std::string> parameters;
    const bool isX265 = isEncoder(encoder, "libx265"), isSvt = isEncoder(encoder, "libsvtav1");
    if (isX265) {
        parameters = x265HdrParameters(subject.hdr);
        parameters.insert(parameters.begin(), "log-level=none");
        // ITU-T H.265 E.3.1 counts the places from 0, FFmpeg from 1.
        if (codec.chroma_sample_location != AVCHROMA_LOC_UNSPECIFIED)
            parameters.push_back(fmt::format("chromaloc={}", int(codec.chroma_sample_location) - 1));
    } else if (isSvt) {
        parameters = svtAv1HdrParameters(subject.hdr);
    }
    if (!asked.empty()) parameters.push_back(asked);
    if (!parameters.empty())
        setOption(codec, isX265 ? "x265-params" : "svtav1-params", fmt::format("{}", fmt::join(parameters, ":")));
}

/// Fields that go through as one picture are coded and tagged as fields, where the codec knows them.
void setFields(AVCodecContext& codec, const AVCodec& encoder, const MovieOrigin* origin, MovieFormat& format)
{
    if (origin == nullptr || origin->isTurned) return;
    const auto order = AVFieldOrder(origin->fieldOrder);
    if (order == AV_FIELD_UNKNOWN) return;
    codec.field_order = order;
    if (order == AV_FIELD_PROGRESSIVE) return;
    format.isInterlaced = true;
    format.isTopFirst = order == AV_FIELD_TT || order == AV_FIELD_TB;
    if (isEncoder(encoder, "libx264") || isEncoder(encoder, "prores_ks") || isEncoder(encoder, "mpeg4"))
        codec.flags |= AV_CODEC_FLAG_INTERLACED_DCT;
    if (isEncoder(encoder, "mpeg2video")) codec.flags |= AV_CODEC_FLAG_INTERLACED_DCT | AV_CODEC_FLAG_INTERLACED_ME;
}

void setAskedOptions(AVCodecContext& codec, const AVCodec& encoder, const MovieSubject& subject,
                     const MovieOptions& options)
{
    if (!options.profile.empty()) {
        const CodecProfile& profile = findProfile(encoder, options.profile);
        codec.profile = profile.number;
        if (av_opt_find(&codec, "profile", nullptr, 0, AV_OPT_SEARCH_CHILDREN) != nullptr)
            setOption(codec, "profile", profile.name);
    }
    if (!options.preset.empty()) {
        if (av_opt_find(codec.priv_data, "preset", nullptr, 0, 0) == nullptr)
            throw Error(ErrorCode::InvalidArgument,
                        "--preset '{}': codec '{}' has no presets; libx264, libx265 and libsvtav1 have", options.preset,
                        encoder.name);
        setAskedOption(codec, encoder, "--preset", "preset", options.preset);
    }
    std::string libraryParameters;
    for (const auto& [name, value] : pairsOf(options.codecOptions)) {
        setAskedOption(codec, encoder, "--codec-options", name, value);
        if (name == "x265-params" || name == "svtav1-params") libraryParameters = value;
    }
    setLibraryParameters(codec, encoder, subject, libraryParameters);
}

/// What the user asked for beside the codec, for the sentence when the encoder refuses.
std::string wishesOf(const MovieOptions& options)
{
    std::string text;
    if (!options.profile.empty()) text += fmt::format(" with --profile {}", options.profile);
    if (!options.preset.empty()) text += fmt::format(" with --preset {}", options.preset);
    if (!options.codecOptions.empty()) text += fmt::format(" with --codec-options {}", options.codecOptions);
    return text;
}

}  // namespace

Rational movieFrameRate(const PlateInfo& plate, const MovieOrigin* origin)
{
    if (origin != nullptr) return origin->frameRate;
    const AVRational rate = av_d2q(plate.fps, 100000);
    return {rate.num, rate.den};
}

Codec openEncoder(const std::string& path, const AVFormatContext& output, const MovieSubject& subject,
                  const WriteOptions& options, Rational timeBase, MovieFormat& format)
{
    const PlateInfo& plate = subject.plate;
    const MovieOrigin* origin = subject.origin;
    const AVCodec* encoder = chooseEncoder(path, *output.oformat, plate, origin, options);
    format.pixelFormat = choosePixelFormat(path, *output.oformat, *encoder, plate, origin, options);
    format.planar = *samplesOf(format.pixelFormat);
    format.colorspace = options.outputColorspace.empty() ? defaultOutputColorspace(plate, false)
                                                         : plate.colors->resolve(options.outputColorspace);

    // As tagged in the plate where the colours are the plate's, so that the codes mean what they meant there.
    ColorTags tags = tagsOf(plate.colors->equivalent(format.colorspace));
    const bool isYuv = format.planar.family == PlanarFormat::Family::Yuv;
    bool isFullRange = !isYuv, staysUntagged = false;
    if (origin != nullptr && format.colorspace == plate.colorspace) {
        tags.transfer = origin->transfer;
        tags.primaries = origin->primaries;
        if (origin->matrix != AVCOL_SPC_RGB) tags.matrix = origin->matrix;
        const bool wasYuv = samplesOf(origin->pixelFormat)->family == PlanarFormat::Family::Yuv;
        if (isYuv == wasYuv) isFullRange = origin->range == AVCOL_RANGE_JPEG;
        staysUntagged = isYuv == wasYuv;
    }
    if (tags.matrix == AVCOL_SPC_UNSPECIFIED) tags.matrix = guessedMatrix(plate.width, plate.height);
    if (isEncoder(*encoder, "mjpeg")) {  // JFIF knows nothing else
        isFullRange = true;
        tags.matrix = AVCOL_SPC_BT470BG;
    }
    if (!options.movie.pixelFormat.empty() && isFullRangeName(av_get_pix_fmt(options.movie.pixelFormat.c_str())))
        isFullRange = true;
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
    // What the plate leaves open stays open where its codes go through: tagged with our guess they would be shown as
    // something else than before by programs that guess otherwise.
    staysUntagged = staysUntagged && tags.matrix == origin->matrix;
    codec->color_range = isFullRange                               ? AVCOL_RANGE_JPEG
                         : staysUntagged && origin->isRangeGuessed ? AVCOL_RANGE_UNSPECIFIED
                                                                   : AVCOL_RANGE_MPEG;
    codec->color_primaries = AVColorPrimaries(tags.primaries);
    codec->color_trc = AVColorTransferCharacteristic(tags.transfer);
    codec->colorspace = staysUntagged && origin->isMatrixGuessed ? AVCOL_SPC_UNSPECIFIED : AVColorSpace(tags.matrix);
    if (origin != nullptr) codec->chroma_sample_location = AVChromaLocation(origin->chromaLocation);
    codec->bits_per_raw_sample = format.planar.bits;
    codec->thread_count = 0;
    codec->strict_std_compliance = FF_COMPLIANCE_UNOFFICIAL;
    if ((output.oformat->flags & AVFMT_GLOBALHEADER) != 0) codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    setFields(*codec, *encoder, origin, format);
    const auto asked = pairsOf(options.movie.codecOptions);
    tune(*codec, *encoder, subject, format.planar, options.quality,
         hasAny(asked, {"qp", "crf", "b", "global_quality", "lossless"}));
    setAskedOptions(*codec, *encoder, subject, options.movie);

    const int result = avcodec_open2(codec.get(), encoder, nullptr);
    if (result < 0)
        throw Error(ErrorCode::InvalidArgument, "codec '{}' cannot write {}x{} {}{} into {} ({})", encoder->name,
                    plate.width, plate.height, pixelFormatName(format.pixelFormat), wishesOf(options.movie), path,
                    errorText(result));
    return codec;
}

}  // namespace virga::io
