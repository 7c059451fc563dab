#include "io/Libav.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <string_view>

#include "core/Error.h"
#include "core/Parallel.h"
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

std::string urlOf(const std::string& path) { return "file:" + path; }

std::string errorText(int error)
{
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    av_strerror(error, text, sizeof text);
    return text;
}

std::optional<PlanarFormat> samplesOf(int pixelFormat)
{
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(pixelFormat));
    if (d == nullptr ||
        (d->flags &
         (AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL | AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_BAYER)) != 0 ||
        std::string_view(d->name).starts_with("xyz"))
        return std::nullopt;
    const bool isPalette = (d->flags & AV_PIX_FMT_FLAG_PAL) != 0;
    PlanarFormat format;
    format.hasAlpha = isPalette || (d->flags & AV_PIX_FMT_FLAG_ALPHA) != 0;
    for (int c = 0; c < d->nb_components; ++c) format.bits = std::max(format.bits, d->comp[c].depth);
    if (format.bits > 16) return std::nullopt;
    if (isPalette || (d->flags & AV_PIX_FMT_FLAG_RGB) != 0) {
        format.family = PlanarFormat::Family::Rgb;
    } else if (d->nb_components - (format.hasAlpha ? 1 : 0) == 1) {
        format.family = PlanarFormat::Family::Grey;
    } else {
        format.chromaShiftX = d->log2_chroma_w;
        format.chromaShiftY = d->log2_chroma_h;
    }
    return format;
}

bool isPlanar(int pixelFormat)
{
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(pixelFormat));
    const auto format = samplesOf(pixelFormat);
    if (!format || (d->flags & AV_PIX_FMT_FLAG_PAL) != 0 || (format->bits > 8 && (d->flags & AV_PIX_FMT_FLAG_BE) != 0))
        return false;
    // In FFmpeg's descriptions red, green and blue are components 0, 1 and 2; in its planes green comes first.
    static constexpr int rgbPlanes[] = {2, 0, 1, 3};
    for (int c = 0; c < d->nb_components; ++c) {
        const AVComponentDescriptor& component = d->comp[c];
        const int plane = format->family == PlanarFormat::Family::Rgb ? rgbPlanes[c] : c;
        if (component.plane != plane || component.step != format->bytesPerSample() || component.offset != 0 ||
            component.shift != 0 || component.depth != format->bits)
            return false;
    }
    return true;
}

int pixelFormatOf(const PlanarFormat& format)
{
    for (const AVPixFmtDescriptor* d = av_pix_fmt_desc_next(nullptr); d != nullptr; d = av_pix_fmt_desc_next(d)) {
        const AVPixelFormat candidate = av_pix_fmt_desc_get_id(d);
        if (!isFullRangeName(candidate) && isPlanar(candidate) && samplesOf(candidate) == format) return candidate;
    }
    return AV_PIX_FMT_NONE;
}

namespace {

constexpr std::array<std::pair<AVPixelFormat, AVPixelFormat>, 5> fullRangeNames = {
    {{AV_PIX_FMT_YUVJ420P, AV_PIX_FMT_YUV420P},
     {AV_PIX_FMT_YUVJ422P, AV_PIX_FMT_YUV422P},
     {AV_PIX_FMT_YUVJ444P, AV_PIX_FMT_YUV444P},
     {AV_PIX_FMT_YUVJ440P, AV_PIX_FMT_YUV440P},
     {AV_PIX_FMT_YUVJ411P, AV_PIX_FMT_YUV411P}}};

}  // namespace

bool isFullRangeName(int pixelFormat) { return withoutRangeName(pixelFormat) != pixelFormat; }

int withoutRangeName(int pixelFormat)
{
    for (const auto& [old, plain] : fullRangeNames)
        if (old == pixelFormat) return plain;
    return pixelFormat;
}

PlanarBuffer::PlanarBuffer(const PlanarFormat& format, int width, int height)
    : format_(format), width_(width), height_(height)
{
    const PlanarPicture sizes = picture();
    for (std::size_t p = 0; p < std::size_t(format.planes()); ++p) {
        const bool isChroma = format.family == PlanarFormat::Family::Yuv && (p == 1 || p == 2);
        planes_[p].resize(std::size_t(sizes.strides[p]) *
                          std::size_t(isChroma ? AV_CEIL_RSHIFT(height, format.chromaShiftY) : height));
    }
}

PlanarPicture PlanarBuffer::picture()
{
    PlanarPicture result;
    result.width = width_;
    result.height = height_;
    for (std::size_t p = 0; p < std::size_t(format_.planes()); ++p) {
        const bool isChroma = format_.family == PlanarFormat::Family::Yuv && (p == 1 || p == 2);
        result.planes[p] = planes_[p].data();
        result.strides[p] =
            (isChroma ? AV_CEIL_RSHIFT(width_, format_.chromaShiftX) : width_) * format_.bytesPerSample();
    }
    return result;
}

ConstPlanarPicture asConst(const PlanarPicture& picture)
{
    ConstPlanarPicture result;
    result.width = picture.width;
    result.height = picture.height;
    result.strides = picture.strides;
    std::copy(picture.planes.begin(), picture.planes.end(), result.planes.begin());
    return result;
}

PlanarPicture planesOf(const AVFrame& frame)
{
    PlanarPicture picture;
    picture.width = frame.width;
    picture.height = frame.height;
    for (std::size_t i = 0; i < 4; ++i) {
        picture.planes[i] = frame.data[i];
        picture.strides[i] = frame.linesize[i];
    }
    return picture;
}

namespace {

/// Calls visit(component, plane, row, width) for all rows of all components of the format.
template <class Visit>
void forEachRow(const PlanarFormat& format, int width, int height, const Visit& visit)
{
    using Family = PlanarFormat::Family;
    static constexpr int rgbPlanes[] = {2, 0, 1, 3};
    for (int component = 0; component < format.planes(); ++component) {
        const bool isChroma = format.family == Family::Yuv && (component == 1 || component == 2);
        const int plane = format.family == Family::Rgb ? rgbPlanes[component] : component;
        const int rows = isChroma ? AV_CEIL_RSHIFT(height, format.chromaShiftY) : height;
        const int columns = isChroma ? AV_CEIL_RSHIFT(width, format.chromaShiftX) : width;
        parallelFor(0, rows, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            std::vector<std::uint16_t> line(static_cast<std::size_t>(columns));
            for (std::ptrdiff_t y = first; y < last; ++y) visit(component, std::size_t(plane), int(y), line);
        });
    }
}

void rescale(std::vector<std::uint16_t>& line, int fromBits, int toBits)
{
    if (fromBits == toBits) return;
    const unsigned from = (1u << fromBits) - 1, to = (1u << toBits) - 1;
    for (std::uint16_t& value : line) value = std::uint16_t((value * to + from / 2) / from);
}

/// Which byte of a row of Y411 (U Y Y V Y Y) holds luma sample x. FFmpeg's description of the format, which knows
/// evenly spaced samples only, has it wrong.
int y411Luma(int x) { return 6 * (x / 4) + 1 + x % 4 + (x % 4) / 2; }

bool isY411Luma(const AVFrame& frame, int component) { return frame.format == AV_PIX_FMT_UYYVYY411 && component == 0; }

}  // namespace

void unpack(const AVFrame& frame, const PlanarFormat& format, const PlanarPicture& planes)
{
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(frame.format));
    const bool isPalette = (d->flags & AV_PIX_FMT_FLAG_PAL) != 0;
    static constexpr int paletteBytes[] = {2, 1, 0, 3};  // 0xAARRGGBB words, lowest byte first
    const std::uint8_t* data[4] = {frame.data[0], frame.data[1], frame.data[2], frame.data[3]};
    forEachRow(format, frame.width, frame.height,
               [&](int component, std::size_t plane, int y, std::vector<std::uint16_t>& line) {
                   if (isY411Luma(frame, component))
                       for (int x = 0; x < frame.width; ++x)
                           line[std::size_t(x)] = frame.data[0][y * frame.linesize[0] + y411Luma(x)];
                   else
                       av_read_image_line2(line.data(), data, frame.linesize, d, 0, y, isPalette ? 0 : component,
                                           int(line.size()), 0, 2);
                   // FFmpeg's own look-up knows the first byte of an entry alone: its description has one component.
                   if (isPalette)
                       for (std::uint16_t& value : line) value = frame.data[1][4 * value + paletteBytes[component]];
                   rescale(line, isPalette ? 8 : d->comp[component].depth, format.bits);
                   std::uint8_t* row = planes.planes[plane] + y * planes.strides[plane];
                   if (format.bits > 8)
                       std::memcpy(row, line.data(), 2 * line.size());
                   else
                       std::copy(line.begin(), line.end(), row);
               });
}

void pack(const ConstPlanarPicture& planes, const PlanarFormat& format, AVFrame& frame)
{
    const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(AVPixelFormat(frame.format));
    // Components that share bytes are written one after the other over zeros; padding stays zero.
    for (int p = 0; p < 4 && frame.buf[p] != nullptr; ++p)
        std::memset(frame.buf[p]->data, 0, std::size_t(frame.buf[p]->size));
    forEachRow(format, frame.width, frame.height,
               [&](int component, std::size_t plane, int y, std::vector<std::uint16_t>& line) {
                   const std::uint8_t* row = planes.planes[plane] + y * planes.strides[plane];
                   if (format.bits > 8)
                       std::memcpy(line.data(), row, 2 * line.size());
                   else
                       std::copy_n(row, line.size(), line.begin());
                   rescale(line, format.bits, d->comp[component].depth);
                   if (isY411Luma(frame, component))
                       for (int x = 0; x < frame.width; ++x)
                           frame.data[0][y * frame.linesize[0] + y411Luma(x)] = std::uint8_t(line[std::size_t(x)]);
                   else
                       av_write_image_line2(line.data(), frame.data, frame.linesize, d, 0, y, component,
                                            int(line.size()), 2);
               });
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
        case AVCOL_SPC_YCGCO: return {.fullRange = fullRange, .isYCgCo = true};
        default: {
            const char* name = av_color_space_name(AVColorSpace(matrix));
            throw Error(ErrorCode::Input, "{}: its colour matrix {} is not supported", path,
                        name != nullptr ? name : "unknown");
        }
    }
}

ChromaFilter chromaSites(int location)
{
    const auto at = [](double x, double y) { return ChromaFilter{{false, x}, {false, y}}; };
    switch (location) {
        case AVCHROMA_LOC_CENTER: return at(0.5, 0.5);
        case AVCHROMA_LOC_TOPLEFT: return at(0, 0);
        case AVCHROMA_LOC_TOP: return at(0.5, 0);
        case AVCHROMA_LOC_BOTTOMLEFT: return at(0, 1);
        case AVCHROMA_LOC_BOTTOM: return at(0.5, 1);
        default: return at(0, 0.5);
    }
}

namespace {

/// Nothing for transfers that are not ours: logarithms of old scanners, and those that nobody specified.
std::optional<Curve> curveOf(int transfer)
{
    switch (transfer) {
        case AVCOL_TRC_LINEAR: return Curve::Linear;
        case AVCOL_TRC_GAMMA22: return Curve::Gamma22;
        case AVCOL_TRC_GAMMA28: return Curve::Gamma28;
        case AVCOL_TRC_SMPTE2084: return Curve::Pq;
        case AVCOL_TRC_ARIB_STD_B67: return Curve::Hlg;
        case AVCOL_TRC_SMPTE428:
            return Curve::Gamma26;  // its 48 cd/m2 are 1, not the 52.37 of the tag
        // Display-referred video, see ColorSpaces.h.
        case AVCOL_TRC_BT709:
        case AVCOL_TRC_SMPTE170M:
        case AVCOL_TRC_SMPTE240M:
        case AVCOL_TRC_IEC61966_2_1:
        case AVCOL_TRC_IEC61966_2_4:
        case AVCOL_TRC_BT1361_ECG:
        case AVCOL_TRC_BT2020_10:
        case AVCOL_TRC_BT2020_12: return Curve::Srgb;
        default: return std::nullopt;
    }
}

/// Null for primaries that are not ours: film, old NTSC, and those that nobody specified.
const Primaries* primariesOf(int tag)
{
    switch (tag) {
        case AVCOL_PRI_BT709: return &primaries::rec709;
        case AVCOL_PRI_SMPTE170M:
        case AVCOL_PRI_SMPTE240M: return &primaries::rec601at525;
        case AVCOL_PRI_BT470BG: return &primaries::rec601at625;
        case AVCOL_PRI_BT2020: return &primaries::rec2020;
        case AVCOL_PRI_SMPTE432: return &primaries::p3d65;
        case AVCOL_PRI_SMPTE431: return &primaries::p3dci;
        default: return nullptr;
    }
}

}  // namespace

ColorClaim colorClaimOf(int transfer, int primaries, int matrix)
{
    const bool hasTransfer = transfer != AVCOL_TRC_UNSPECIFIED && transfer != AVCOL_TRC_RESERVED0;
    const bool hasPrimaries = primaries != AVCOL_PRI_UNSPECIFIED && primaries != AVCOL_PRI_RESERVED0;
    const std::optional<Curve> curve = curveOf(transfer);
    const Primaries* known = primariesOf(primaries);
    std::string source, doubt;
    const auto add = [&](bool isTagged, bool isKnown, const char* name, const char* what) {
        if (!isTagged) return;
        source +=
            fmt::format("{}{} {}", source.empty() ? "metadata: " : ", ", name != nullptr ? name : "unknown", what);
        if (isKnown) return;
        source += " (not supported)";
        doubt += fmt::format("{}its {} {}", doubt.empty() ? "" : ", ", what, name != nullptr ? name : "unknown");
    };
    add(hasTransfer, curve.has_value(), av_color_transfer_name(AVColorTransferCharacteristic(transfer)), "transfer");
    add(hasPrimaries, known != nullptr, av_color_primaries_name(AVColorPrimaries(primaries)), "primaries");
    if (!doubt.empty()) doubt += " cannot be converted";
    if (known == nullptr && matrix == AVCOL_SPC_BT2020_NCL) {  // nobody else uses it
        known = &primaries::rec2020;
        add(true, true, av_color_space_name(AVColorSpace(matrix)), "matrix");
    }
    if (source.empty()) source = "guess: video that does not say";
    const NamedSpace* space =
        findOwnColorspace(curve.value_or(Curve::Srgb), known != nullptr ? *known : primaries::rec709);
    return {space->name, source, doubt};
}

ColorTags tagsOf(const NamedSpace* space)
{
    ColorTags tags{AVCOL_TRC_UNSPECIFIED, AVCOL_PRI_UNSPECIFIED, AVCOL_SPC_UNSPECIFIED};
    if (space == nullptr || space->primaries == nullptr) return tags;
    tags.matrix = AVCOL_SPC_BT709;
    const Primaries* const p = space->primaries;
    if (p == &primaries::rec709) tags.primaries = AVCOL_PRI_BT709;
    if (p == &primaries::rec601at525) tags = {tags.transfer, AVCOL_PRI_SMPTE170M, AVCOL_SPC_SMPTE170M};
    if (p == &primaries::rec601at625) tags = {tags.transfer, AVCOL_PRI_BT470BG, AVCOL_SPC_BT470BG};
    if (p == &primaries::rec2020) tags = {tags.transfer, AVCOL_PRI_BT2020, AVCOL_SPC_BT2020_NCL};
    if (p == &primaries::p3d65) tags.primaries = AVCOL_PRI_SMPTE432;
    if (p == &primaries::p3dci) tags.primaries = AVCOL_PRI_SMPTE431;
    switch (space->curve) {
        case Curve::Linear: tags.transfer = AVCOL_TRC_LINEAR; break;
        // Players show the tag "sRGB" and "BT.709" alike or the first one worse; editors know the second one better.
        case Curve::Srgb:
        case Curve::Rec709Camera:
        case Curve::Bt1886:
            tags.transfer = tags.primaries == AVCOL_PRI_BT2020   ? AVCOL_TRC_BT2020_10
                            : tags.matrix == AVCOL_SPC_SMPTE170M ? AVCOL_TRC_SMPTE170M
                                                                 : AVCOL_TRC_BT709;
            break;
        case Curve::Gamma22: tags.transfer = AVCOL_TRC_GAMMA22; break;
        case Curve::Gamma26: tags.transfer = AVCOL_TRC_SMPTE428; break;
        case Curve::Gamma28: tags.transfer = AVCOL_TRC_GAMMA28; break;
        case Curve::Pq: tags.transfer = AVCOL_TRC_SMPTE2084; break;
        case Curve::Hlg: tags.transfer = AVCOL_TRC_ARIB_STD_B67; break;
        default: break;  // no tag says Adobe RGB or a logarithm of cameras
    }
    return tags;
}

}  // namespace virga::io::libav
