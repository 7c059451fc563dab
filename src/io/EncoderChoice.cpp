#include "io/EncoderChoice.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cstring>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Words.h"

namespace virga::io {

using namespace libav;

bool isEncoder(const AVCodec& encoder, const char* name) { return std::strcmp(encoder.name, name) == 0; }

namespace {

/// Encoders worth naming to a user, best first.
constexpr const char* usualEncoders[] = {
    "libx264", "libx265", "prores_ks", "dnxhd",   "ffv1",  "libvpx-vp9", "libsvtav1", "libaom-av1", "mjpeg", "cfhd",
    "mpeg4",   "utvideo", "huffyuv",   "ffvhuff", "qtrle", "mpeg2video", "rawvideo",  "libx264rgb", "png"};

bool isMuxer(const AVOutputFormat& container, const char* name) { return std::strcmp(container.name, name) == 0; }

/// Muxers that answer for their default codec alone, and what they take.
struct KnownContainer {
    const char* muxer;
    std::vector<AVCodecID> codecs;
};
const std::vector<KnownContainer>& knownContainers()
{
    static const std::vector<KnownContainer> known = {
        {"mxf",
         {AV_CODEC_ID_MPEG2VIDEO, AV_CODEC_ID_DNXHD, AV_CODEC_ID_PRORES, AV_CODEC_ID_H264, AV_CODEC_ID_JPEG2000,
          AV_CODEC_ID_DVVIDEO}},
        {"mpegts",
         {AV_CODEC_ID_MPEG1VIDEO, AV_CODEC_ID_MPEG2VIDEO, AV_CODEC_ID_MPEG4, AV_CODEC_ID_H264, AV_CODEC_ID_HEVC}},
        {"mpeg", {AV_CODEC_ID_MPEG1VIDEO, AV_CODEC_ID_MPEG2VIDEO, AV_CODEC_ID_H264}},
        {"vob", {AV_CODEC_ID_MPEG1VIDEO, AV_CODEC_ID_MPEG2VIDEO}},
        {"dvd", {AV_CODEC_ID_MPEG2VIDEO}}};
    return known;
}

bool fits(const AVOutputFormat& container, const AVCodec& encoder)
{
    for (const KnownContainer& known : knownContainers())
        if (isMuxer(container, known.muxer))
            return std::find(known.codecs.begin(), known.codecs.end(), encoder.id) != known.codecs.end();
    // What Matroska has no name of its own for goes in under its name in AVI.
    if (isMuxer(container, "matroska")) {
        const AVCodecTag* const riff[] = {avformat_get_riff_video_tags(), nullptr};
        if (av_codec_get_tag(riff, encoder.id) != 0) return true;
    }
    return avformat_query_codec(&container, encoder.id, FF_COMPLIANCE_NORMAL) == 1;
}

std::string encodersFor(const AVOutputFormat& container)
{
    std::vector<std::string> names;
    for (const char* name : usualEncoders)
        if (const AVCodec* encoder = avcodec_find_encoder_by_name(name);
            encoder != nullptr && fits(container, *encoder))
            names.emplace_back(name);
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

/// Encoders for a plate without a wish of the user's, best first.
std::vector<const char*> candidatesFor(const AVOutputFormat& container, const PlateInfo& plate,
                                       const MovieOrigin* origin, const WriteOptions& options)
{
    std::vector<const char*> candidates;
    // What is piped into another program should not lose anything on the way.
    if (isMuxer(container, "nut")) candidates = {"rawvideo"};
    // A plate that was kept without loss, or for editing, goes on like that where the container can hold it.
    switch (origin != nullptr ? AVCodecID(origin->codecId) : AV_CODEC_ID_NONE) {
        case AV_CODEC_ID_PRORES: candidates.push_back("prores_ks"); break;
        case AV_CODEC_ID_DNXHD: candidates.push_back("dnxhd"); break;
        case AV_CODEC_ID_FFV1: candidates.push_back("ffv1"); break;
        case AV_CODEC_ID_HUFFYUV:
        case AV_CODEC_ID_FFVHUFF: candidates.insert(candidates.end(), {"ffvhuff", "ffv1"}); break;
        case AV_CODEC_ID_UTVIDEO: candidates.push_back("utvideo"); break;
        case AV_CODEC_ID_RAWVIDEO: candidates.push_back("rawvideo"); break;
        case AV_CODEC_ID_QTRLE: candidates.push_back("qtrle"); break;
        case AV_CODEC_ID_PNG: candidates.push_back("png"); break;
        case AV_CODEC_ID_MJPEG: candidates.push_back("mjpeg"); break;
        case AV_CODEC_ID_HEVC: candidates.push_back("libx265"); break;
        case AV_CODEC_ID_VP9: candidates.push_back("libvpx-vp9"); break;
        case AV_CODEC_ID_AV1: {
            // The fast one has 4:2:0 alone.
            const auto samples = samplesOf(origin->pixelFormat);
            const bool isShared = samples && samples->chromaShiftX == 1 && samples->chromaShiftY == 1;
            candidates.push_back(isShared && samples->bits <= 10 && options.movie.pixelFormat.empty() ? "libsvtav1"
                                                                                                      : "libaom-av1");
            break;
        }
        default: break;
    }
    if (isMuxer(container, "mxf")) candidates.push_back(plate.bitDepth > 8 ? "prores_ks" : "mpeg2video");
    candidates.insert(candidates.end(), {"libx264", "libvpx-vp9"});
    return candidates;
}

}  // namespace

const AVCodec* chooseEncoder(const std::string& path, const AVOutputFormat& container, const PlateInfo& plate,
                             const MovieOrigin* origin, const WriteOptions& options)
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
    for (const char* name : candidatesFor(container, plate, origin, options)) {
        // AVI takes H.264 by name only: it has no place for the order of pictures.
        if (isMuxer(container, "avi") && std::strcmp(name, "libx264") == 0) continue;
        if (const AVCodec* encoder = avcodec_find_encoder_by_name(name);
            encoder != nullptr && fits(container, *encoder))
            return encoder;
    }
    if (const AVCodec* encoder = avcodec_find_encoder(container.video_codec)) return encoder;
    throw Error(ErrorCode::Output,
                "{}: no encoder is there for {} files; name another kind of output, such as .mp4 or .mkv", path,
                container.name);
}

namespace {

// clang-format off
/// ITU-T H.264 annex A, H.265 annex A, VP9 and AV1 bitstream specifications (annex A), Apple ProRes white paper,
/// SMPTE ST 2019-1 (VC-3), ISO 13818-2 clause 8.
constexpr CodecProfile profiles[] = {
    {"libx264", "baseline", FF_PROFILE_H264_BASELINE, 8, 1, 1, false},
    {"libx264", "main", FF_PROFILE_H264_MAIN, 8, 1, 1, false},
    {"libx264", "high", FF_PROFILE_H264_HIGH, 8, 1, 1, false},
    {"libx264", "high10", FF_PROFILE_H264_HIGH_10, 10, 1, 1, false},
    {"libx264", "high422", FF_PROFILE_H264_HIGH_422, 10, 1, 0, false},
    {"libx264", "high444", FF_PROFILE_H264_HIGH_444_PREDICTIVE, 14, 0, 0, false},
    {"libx265", "main", FF_PROFILE_HEVC_MAIN, 8, 1, 1, false},
    {"libx265", "main10", FF_PROFILE_HEVC_MAIN_10, 10, 1, 1, false},
    {"libx265", "main12", FF_PROFILE_HEVC_REXT, 12, 1, 1, false},
    {"libx265", "main422-10", FF_PROFILE_HEVC_REXT, 10, 1, 0, false},
    {"libx265", "main422-12", FF_PROFILE_HEVC_REXT, 12, 1, 0, false},
    {"libx265", "main444-8", FF_PROFILE_HEVC_REXT, 8, 0, 0, false},
    {"libx265", "main444-10", FF_PROFILE_HEVC_REXT, 10, 0, 0, false},
    {"libx265", "main444-12", FF_PROFILE_HEVC_REXT, 12, 0, 0, false},
    {"prores_ks", "proxy", FF_PROFILE_PRORES_PROXY, 10, 1, 0, false},
    {"prores_ks", "lt", FF_PROFILE_PRORES_LT, 10, 1, 0, false},
    {"prores_ks", "standard", FF_PROFILE_PRORES_STANDARD, 10, 1, 0, false},
    {"prores_ks", "hq", FF_PROFILE_PRORES_HQ, 10, 1, 0, false},
    {"prores_ks", "4444", FF_PROFILE_PRORES_4444, 12, 0, 0, true},
    {"prores_ks", "4444xq", FF_PROFILE_PRORES_XQ, 12, 0, 0, true},
    {"dnxhd", "dnxhr_lb", FF_PROFILE_DNXHR_LB, 8, 1, 0, false},
    {"dnxhd", "dnxhr_sq", FF_PROFILE_DNXHR_SQ, 8, 1, 0, false},
    {"dnxhd", "dnxhr_hq", FF_PROFILE_DNXHR_HQ, 8, 1, 0, false},
    {"dnxhd", "dnxhr_hqx", FF_PROFILE_DNXHR_HQX, 10, 1, 0, false},
    {"dnxhd", "dnxhr_444", FF_PROFILE_DNXHR_444, 10, 0, 0, false},
    {"libvpx-vp9", "0", FF_PROFILE_VP9_0, 8, 1, 1, false},
    {"libvpx-vp9", "1", FF_PROFILE_VP9_1, 8, 0, 0, false},
    {"libvpx-vp9", "2", FF_PROFILE_VP9_2, 12, 1, 1, false},
    {"libvpx-vp9", "3", FF_PROFILE_VP9_3, 12, 0, 0, false},
    {"libsvtav1", "main", FF_PROFILE_AV1_MAIN, 10, 1, 1, false},
    {"libaom-av1", "main", FF_PROFILE_AV1_MAIN, 10, 1, 1, false},
    {"libaom-av1", "high", FF_PROFILE_AV1_HIGH, 10, 0, 0, false},
    {"libaom-av1", "professional", FF_PROFILE_AV1_PROFESSIONAL, 12, 0, 0, false},
    {"mpeg2video", "main", FF_PROFILE_MPEG2_MAIN, 8, 1, 1, false},
    {"mpeg2video", "422", FF_PROFILE_MPEG2_422, 8, 1, 0, false},
};
// clang-format on

}  // namespace

const CodecProfile& findProfile(const AVCodec& encoder, const std::string& name)
{
    std::vector<std::string> names;
    for (const CodecProfile& profile : profiles) {
        if (!isEncoder(encoder, profile.encoder)) continue;
        if (name == profile.name) return profile;
        names.emplace_back(profile.name);
    }
    if (names.empty())
        throw Error(ErrorCode::InvalidArgument, "--profile '{}': codec '{}' has no profiles to choose from", name,
                    encoder.name);
    throw Error(ErrorCode::InvalidArgument, "--profile '{}': codec '{}' has {}", name, encoder.name,
                fmt::join(names, ", "));
}

namespace {

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
    const auto isAny = [&](std::initializer_list<const char*> names) {
        return std::any_of(names.begin(), names.end(), [&](const char* name) { return isEncoder(encoder, name); });
    };
    format.hasAlpha = plate.hasAlpha;
    if (isAny({"ffv1", "utvideo", "qtrle", "png", "libx264rgb", "rawvideo", "cfhd"})) {
        format.family = Family::Rgb;
        format.bits = plate.isFloat ? 16 : plate.bitDepth;
    } else if (isAny({"prores_ks", "prores", "dnxhd"})) {
        format.bits = 10;
        format.chromaShiftX = plate.hasAlpha ? 0 : 1;
    } else {
        format.chromaShiftX = format.chromaShiftY = 1;  // what every player shows
    }
    return format;
}

/// The most of `wanted` that the profile can hold.
PlanarFormat within(PlanarFormat wanted, const CodecProfile& profile)
{
    const bool isProRes = std::strcmp(profile.encoder, "prores_ks") == 0;
    if (wanted.family != PlanarFormat::Family::Yuv) wanted = {.bits = wanted.bits, .hasAlpha = wanted.hasAlpha};
    wanted.bits = std::min(wanted.bits, profile.bits);
    // A family for editing is told by its name: 4444 means no shared chroma, whatever the plate has.
    const bool isByName = isProRes || std::strcmp(profile.encoder, "dnxhd") == 0;
    wanted.chromaShiftX = isByName ? profile.chromaShiftX : std::max(wanted.chromaShiftX, profile.chromaShiftX);
    wanted.chromaShiftY = isByName ? profile.chromaShiftY : std::max(wanted.chromaShiftY, profile.chromaShiftY);
    if (isByName) wanted.bits = std::min(10, profile.bits);
    wanted.hasAlpha = wanted.hasAlpha && profile.hasAlpha;
    return wanted;
}

/// What Y4M can say of its pixels.
constexpr AVPixelFormat y4mFormats[] = {
    AV_PIX_FMT_YUV420P,   AV_PIX_FMT_YUV422P,   AV_PIX_FMT_YUV444P,   AV_PIX_FMT_YUV411P,   AV_PIX_FMT_GRAY8,
    AV_PIX_FMT_GRAY9,     AV_PIX_FMT_GRAY10,    AV_PIX_FMT_GRAY12,    AV_PIX_FMT_GRAY16,    AV_PIX_FMT_YUV420P9,
    AV_PIX_FMT_YUV422P9,  AV_PIX_FMT_YUV444P9,  AV_PIX_FMT_YUV420P10, AV_PIX_FMT_YUV422P10, AV_PIX_FMT_YUV444P10,
    AV_PIX_FMT_YUV420P12, AV_PIX_FMT_YUV422P12, AV_PIX_FMT_YUV444P12, AV_PIX_FMT_YUV420P14, AV_PIX_FMT_YUV422P14,
    AV_PIX_FMT_YUV444P14, AV_PIX_FMT_YUV420P16, AV_PIX_FMT_YUV422P16, AV_PIX_FMT_YUV444P16};

/// Uncompressed pixels that QuickTime has names for, AVI, and Matroska.
constexpr AVPixelFormat rawMovFormats[] = {AV_PIX_FMT_UYVY422, AV_PIX_FMT_YUYV422,  AV_PIX_FMT_RGB24,
                                           AV_PIX_FMT_ARGB,    AV_PIX_FMT_RGB48BE, AV_PIX_FMT_GRAY16BE};
constexpr AVPixelFormat rawAviFormats[] = {AV_PIX_FMT_YUV420P, AV_PIX_FMT_YUV422P, AV_PIX_FMT_UYVY422,
                                           AV_PIX_FMT_YUYV422, AV_PIX_FMT_GRAY8,   AV_PIX_FMT_BGR24,
                                           AV_PIX_FMT_BGRA};
constexpr AVPixelFormat rawMatroskaFormats[] = {AV_PIX_FMT_YUV420P, AV_PIX_FMT_YUV422P, AV_PIX_FMT_UYVY422,
                                                AV_PIX_FMT_YUYV422, AV_PIX_FMT_GRAY8,   AV_PIX_FMT_RGBA};

/// Every other container calls uncompressed pixels by FFmpeg's names; what has none cannot be read again.
std::vector<AVPixelFormat> namedRawFormats()
{
    std::vector<AVPixelFormat> result;
    for (const AVPixFmtDescriptor* p = nullptr; (p = av_pix_fmt_desc_next(p)) != nullptr;)
        if (const AVPixelFormat format = av_pix_fmt_desc_get_id(p);
            avcodec_pix_fmt_to_codec_tag(format) != 0 && samplesOf(format))
            result.push_back(format);
    return result;
}

/// What the encoder takes into this container, by the plain names; empty: anything.
std::vector<AVPixelFormat> formatsOf(const AVOutputFormat& container, const AVCodec& encoder)
{
    if (isMuxer(container, "yuv4mpegpipe")) return {std::begin(y4mFormats), std::end(y4mFormats)};
    if (encoder.id == AV_CODEC_ID_RAWVIDEO) {
        if (isMuxer(container, "mov")) return {std::begin(rawMovFormats), std::end(rawMovFormats)};
        if (isMuxer(container, "avi")) return {std::begin(rawAviFormats), std::end(rawAviFormats)};
        if (isMuxer(container, "matroska")) return {std::begin(rawMatroskaFormats), std::end(rawMatroskaFormats)};
        return namedRawFormats();
    }
    std::vector<AVPixelFormat> result;
    for (const AVPixelFormat* p = encoder.pix_fmts; p != nullptr && *p != AV_PIX_FMT_NONE; ++p)
        if (samplesOf(*p)) result.push_back(*p);
    return result;
}

AVPixelFormat askedFormat(const std::string& name, const AVCodec& encoder, const std::vector<AVPixelFormat>& formats)
{
    std::vector<std::string> names;
    for (const AVPixelFormat format : formats) names.emplace_back(pixelFormatName(format));
    const std::string allowed = fmt::format("{}", fmt::join(names, ", "));
    const AVPixelFormat format = av_get_pix_fmt(name.c_str());
    if (format == AV_PIX_FMT_NONE || !samplesOf(format)) {
        constexpr std::size_t most = 250;  // letters: FFV1 takes 50 formats
        throw Error(ErrorCode::InvalidArgument,
                    "--pixel-format '{}': is not known or not supported; codec '{}' takes {}", name, encoder.name,
                    allowed.empty()         ? "any that FFmpeg names, such as yuv422p10le"
                    : allowed.size() > most ? allowed.substr(0, allowed.rfind(',', most)) + " and others"
                                            : allowed);
    }
    const auto isSame = [&](AVPixelFormat p) { return p == format || withoutRangeName(p) == withoutRangeName(format); };
    const auto found = std::find(formats.begin(), formats.end(), format) != formats.end()
                           ? std::find(formats.begin(), formats.end(), format)
                           : std::find_if(formats.begin(), formats.end(), isSame);
    if (!formats.empty() && found == formats.end()) {
        const std::string nearest = nearestWord(name, names);
        throw Error(ErrorCode::InvalidArgument, "--pixel-format '{}': codec '{}' takes {}", name, encoder.name,
                    allowed.size() <= 350 ? allowed
                                          : fmt::format("{} formats, the nearest of them {}", names.size(),
                                                        nearest.empty() ? names.front() : nearest));
    }
    return formats.empty() ? format : *found;
}

/// What is lost, then what is spent, by writing `wanted` as `format`; 0: nothing.
double lossOf(const PlanarFormat& wanted, const PlanarFormat& format)
{
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
}

}  // namespace

int choosePixelFormat(const std::string& path, const AVOutputFormat& container, const AVCodec& encoder,
                      const PlateInfo& plate, const MovieOrigin* origin, const WriteOptions& options)
{
    const int plateFormat = origin != nullptr ? origin->pixelFormat : int(AV_PIX_FMT_NONE);
    const std::vector<AVPixelFormat> all = formatsOf(container, encoder);
    if (!options.movie.pixelFormat.empty()) return askedFormat(options.movie.pixelFormat, encoder, all);

    PlanarFormat wanted = wantedFormat(plate, origin, encoder);
    if (!options.movie.profile.empty()) wanted = within(wanted, findProfile(encoder, options.movie.profile));
    const bool evenOnly = isEncoder(encoder, "libx264") || isEncoder(encoder, "libx265");
    const auto splitsEvenly = [&](const PlanarFormat& format) {
        return plate.width % (1 << format.chromaShiftX) == 0 && plate.height % (1 << format.chromaShiftY) == 0;
    };
    if (evenOnly && !splitsEvenly(wanted)) {
        wanted.chromaShiftX = wanted.chromaShiftY = 0;
        log::info("{}: {} cannot share colour between pixels of a picture of {}x{}; written as 4:4:4", path,
                  encoder.name, plate.width, plate.height);
    }
    const int wantedFormat = pixelFormatOf(wanted);
    if (all.empty()) {
        if (plateFormat != AV_PIX_FMT_NONE && samplesOf(plateFormat) == wanted) return plateFormat;
        if (wantedFormat != AV_PIX_FMT_NONE) return wantedFormat;
    }
    std::vector<AVPixelFormat> usable;
    std::copy_if(all.begin(), all.end(), std::back_inserter(usable),
                 [&](AVPixelFormat p) { return !evenOnly || splitsEvenly(*samplesOf(p)); });
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

    const AVPixelFormat best = *std::min_element(usable.begin(), usable.end(), [&](auto a, auto b) {
        return lossOf(wanted, *samplesOf(a)) < lossOf(wanted, *samplesOf(b));
    });
    log::info("{}: {} has no {}; written as {}", path, encoder.name,
              wantedFormat == AV_PIX_FMT_NONE ? "such pixels" : pixelFormatName(wantedFormat), pixelFormatName(best));
    if (wanted.hasAlpha && !samplesOf(best)->hasAlpha)
        log::warning("{}: {} has no alpha; it is left out and the picture stands over black", path, encoder.name);
    return best;
}

}  // namespace virga::io
