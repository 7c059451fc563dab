#include "io/Libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/log.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <new>
#include <string_view>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ColorConversion.h"

namespace virga::io::libav {

void CloseInput::operator()(AVFormatContext* context) const noexcept { avformat_close_input(&context); }
void CloseOutput::operator()(AVFormatContext* context) const noexcept
{
    if (context->oformat != nullptr && (context->oformat->flags & AVFMT_NOFILE) == 0) avio_closep(&context->pb);
    avformat_free_context(context);
}
void FreeCodec::operator()(AVCodecContext* context) const noexcept { avcodec_free_context(&context); }
void FreeFrame::operator()(AVFrame* frame) const noexcept { av_frame_free(&frame); }
void FreePacket::operator()(AVPacket* packet) const noexcept { av_packet_free(&packet); }
void FreeScaler::operator()(SwsContext* scaler) const noexcept { sws_freeContext(scaler); }

Frame makeFrame()
{
    Frame frame(av_frame_alloc());
    if (!frame) throw std::bad_alloc();
    return frame;
}

Packet makePacket()
{
    Packet packet(av_packet_alloc());
    if (!packet) throw std::bad_alloc();
    return packet;
}

std::string errorText(int error)
{
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(error, text, sizeof text);
    return text;
}

void routeMessages()
{
    static std::once_flag once;
    std::call_once(once, [] {
        av_log_set_callback([](void* object, int level, const char* format, va_list arguments) {
            if (level > AV_LOG_WARNING) return;
            char line[1024];
            int atLineStart = 1;
            av_log_format_line(object, level, format, arguments, line, sizeof line, &atLineStart);
            std::string text(line);
            while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
            try {
                if (!text.empty()) log::writeDetail(text);
            } catch (...) {  // a message that is lost is better than an exception through C
            }
        });
    });
}

std::optional<PlanarFormat> planarFormat(int pixelFormat)
{
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(pixelFormat));
    if (d == nullptr || (d->flags & (AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL |
                                     AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER)) != 0)
        return std::nullopt;
    PlanarFormat format;
    format.bits = d->comp[0].depth;
    format.hasAlpha = (d->flags & AV_PIX_FMT_FLAG_ALPHA) != 0;
    const bool isGrey = d->nb_components - (format.hasAlpha ? 1 : 0) == 1;
    if (format.bits < 8 || format.bits > 16 || (format.bits > 8 && (d->flags & AV_PIX_FMT_FLAG_BE) != 0)) return std::nullopt;
    if (!isGrey && (d->flags & AV_PIX_FMT_FLAG_PLANAR) == 0) return std::nullopt;
    for (int c = 0; c < d->nb_components; ++c)
        if (d->comp[c].step != format.bytesPerSample() || d->comp[c].shift != 0 || d->comp[c].offset != 0 ||
            d->comp[c].depth != format.bits)
            return std::nullopt;
    format.family = isGrey ? PlanarFormat::Family::Grey
                           : (d->flags & AV_PIX_FMT_FLAG_RGB) != 0 ? PlanarFormat::Family::Rgb : PlanarFormat::Family::Yuv;
    if (format.family == PlanarFormat::Family::Yuv) {
        format.chromaShiftX = d->log2_chroma_w;
        format.chromaShiftY = d->log2_chroma_h;
    }
    return format;
}

int pixelFormatOf(const PlanarFormat& format)
{
    for (const AVPixFmtDescriptor* d = av_pix_fmt_desc_next(nullptr); d != nullptr; d = av_pix_fmt_desc_next(d)) {
        const AVPixelFormat candidate = av_pix_fmt_desc_get_id(d);
        if (!isFullRangeName(candidate) && planarFormat(candidate) == format) return candidate;
    }
    return AV_PIX_FMT_NONE;
}

int planarEquivalent(int pixelFormat)
{
    if (planarFormat(pixelFormat)) return pixelFormat;
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(pixelFormat));
    if (d == nullptr || (d->flags & (AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER)) != 0 ||
        std::string_view(d->name).starts_with("xyz") || sws_isSupportedInput(AVPixelFormat(pixelFormat)) == 0)
        return AV_PIX_FMT_NONE;
    PlanarFormat format;
    format.hasAlpha = (d->flags & AV_PIX_FMT_FLAG_ALPHA) != 0 || pixelFormat == AV_PIX_FMT_PAL8;
    for (int c = 0; c < d->nb_components; ++c) format.bits = std::max(format.bits, d->comp[c].depth);
    const bool isRgb = (d->flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL)) != 0;
    const bool isGrey = !isRgb && d->nb_components - (format.hasAlpha ? 1 : 0) == 1;
    // Grey with alpha has no planar form; black and white bits have theirs in 8-bit grey.
    format.family = isRgb || (isGrey && format.hasAlpha) ? PlanarFormat::Family::Rgb
                    : isGrey                             ? PlanarFormat::Family::Grey
                                                         : PlanarFormat::Family::Yuv;
    if (format.family == PlanarFormat::Family::Yuv) {
        format.chromaShiftX = d->log2_chroma_w;
        format.chromaShiftY = d->log2_chroma_h;
    }
    if (format.family == PlanarFormat::Family::Rgb && format.hasAlpha && format.bits > 8) format.bits = 16;
    return pixelFormatOf(format);
}

namespace {

constexpr std::array<std::pair<AVPixelFormat, AVPixelFormat>, 5> fullRangeNames = {{
    {AV_PIX_FMT_YUVJ420P, AV_PIX_FMT_YUV420P}, {AV_PIX_FMT_YUVJ422P, AV_PIX_FMT_YUV422P},
    {AV_PIX_FMT_YUVJ444P, AV_PIX_FMT_YUV444P}, {AV_PIX_FMT_YUVJ440P, AV_PIX_FMT_YUV440P},
    {AV_PIX_FMT_YUVJ411P, AV_PIX_FMT_YUV411P}}};

}  // namespace

bool isFullRangeName(int pixelFormat) { return withoutRangeName(pixelFormat) != pixelFormat; }

int withoutRangeName(int pixelFormat)
{
    for (const auto& [old, plain] : fullRangeNames)
        if (old == pixelFormat) return plain;
    return pixelFormat;
}

const char* pixelFormatName(int pixelFormat)
{
    const char* name = av_get_pix_fmt_name(AVPixelFormat(pixelFormat));
    return name != nullptr ? name : "unknown";
}

int guessedMatrix(int width, int height)
{
    // The longer and the shorter side, so that a picture turned upright is guessed like the one it came from.
    const bool isStandardDefinition = std::max(width, height) < 1280 && std::min(width, height) <= 576;
    return isStandardDefinition ? AVCOL_SPC_SMPTE170M : AVCOL_SPC_BT709;
}

YuvCoding yuvCoding(int matrix, bool fullRange, const std::string& path)
{
    // ITU-T H.273, table 4.
    switch (matrix) {
    case AVCOL_SPC_RGB:  // for planes that hold R'G'B' the weights are not used
    case AVCOL_SPC_BT709: return {0.2126, 0.0722, fullRange};
    case AVCOL_SPC_FCC: return {0.30, 0.11, fullRange};
    case AVCOL_SPC_BT470BG:
    case AVCOL_SPC_SMPTE170M: return {0.299, 0.114, fullRange};
    case AVCOL_SPC_SMPTE240M: return {0.212, 0.087, fullRange};
    case AVCOL_SPC_BT2020_NCL: return {0.2627, 0.0593, fullRange};
    default: {
        const char* name = av_color_space_name(AVColorSpace(matrix));
        throw Error(ErrorCode::Input, "{}: its colour matrix {} is not supported", path, name != nullptr ? name : "unknown");
    }
    }
}

std::string colorspaceOf(int transfer, int primaries)
{
    const auto curve = [&] {
        switch (transfer) {
        case AVCOL_TRC_LINEAR: return Curve::Linear;
        case AVCOL_TRC_GAMMA22: return Curve::Gamma22;
        case AVCOL_TRC_GAMMA28: return Curve::Gamma28;
        case AVCOL_TRC_SMPTE2084: return Curve::Pq;
        case AVCOL_TRC_ARIB_STD_B67: return Curve::Hlg;
        case AVCOL_TRC_SMPTE428: return Curve::Gamma26;
        default: return Curve::Srgb;
        }
    }();
    const char* linear = [&] {
        switch (primaries) {
        case AVCOL_PRI_SMPTE170M:
        case AVCOL_PRI_SMPTE240M: return "Linear Rec.601 525";
        case AVCOL_PRI_BT470BG: return "Linear Rec.601 625";
        case AVCOL_PRI_BT2020: return "Linear Rec.2020";
        case AVCOL_PRI_SMPTE432: return "Linear P3-D65";
        default: return "Linear Rec.709";
        }
    }();
    if (const NamedSpace* space = findOwnColorspace(curve, linear)) return space->name;
    // The curve matters more than the primaries: nothing is converted between primaries unless it is asked for.
    for (const char* fallback : {"Linear Rec.709", "Linear Rec.2020", "Linear P3-D65"})
        if (const NamedSpace* space = findOwnColorspace(curve, fallback)) return space->name;
    return "sRGB";
}

ColorTags tagsOf(const std::string& colorspace)
{
    const NamedSpace* space = findOwnColorspace(colorspace);
    if (space == nullptr || space->primaries == nullptr)
        return {AVCOL_TRC_UNSPECIFIED, AVCOL_PRI_UNSPECIFIED, AVCOL_SPC_UNSPECIFIED};
    ColorTags tags{AVCOL_TRC_UNSPECIFIED, AVCOL_PRI_UNSPECIFIED, AVCOL_SPC_BT709};
    const std::string linear = space->primaries->linearName;
    if (linear == "Linear Rec.709") tags.primaries = AVCOL_PRI_BT709;
    if (linear == "Linear Rec.601 525") tags = {tags.transfer, AVCOL_PRI_SMPTE170M, AVCOL_SPC_SMPTE170M};
    if (linear == "Linear Rec.601 625") tags = {tags.transfer, AVCOL_PRI_BT470BG, AVCOL_SPC_BT470BG};
    if (linear == "Linear Rec.2020") tags = {tags.transfer, AVCOL_PRI_BT2020, AVCOL_SPC_BT2020_NCL};
    if (linear == "Linear P3-D65") tags.primaries = AVCOL_PRI_SMPTE432;
    switch (space->curve) {
    case Curve::Linear: tags.transfer = AVCOL_TRC_LINEAR; break;
    // Players show the tag "sRGB" and "BT.709" alike or the first one worse; editors know the second one better.
    case Curve::Srgb:
    case Curve::Rec709Camera:
    case Curve::Bt1886:
        tags.transfer = tags.primaries == AVCOL_PRI_BT2020      ? AVCOL_TRC_BT2020_10
                        : tags.matrix == AVCOL_SPC_SMPTE170M ? AVCOL_TRC_SMPTE170M
                                                                : AVCOL_TRC_BT709;
        break;
    case Curve::Gamma22: tags.transfer = AVCOL_TRC_GAMMA22; break;
    case Curve::Gamma26: tags.transfer = AVCOL_TRC_SMPTE428; break;
    case Curve::Gamma28: tags.transfer = AVCOL_TRC_GAMMA28; break;
    case Curve::Pq: tags.transfer = AVCOL_TRC_SMPTE2084; break;
    case Curve::Cineon: break;
    case Curve::Hlg: tags.transfer = AVCOL_TRC_ARIB_STD_B67; break;
    }
    return tags;
}

}  // namespace virga::io::libav
