#include "io/MovieDescription.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "core/Log.h"
#include "io/CleanAperture.h"
#include "io/ColorConversion.h"

namespace virga::io {

using namespace libav;

namespace {

/// AV_FIELD_TB is "coded top first, shown bottom first", and what is shown counts.
Scan scanOfOrder(AVFieldOrder order)
{
    switch (order) {
        case AV_FIELD_PROGRESSIVE: return Scan::Progressive;
        case AV_FIELD_TT:
        case AV_FIELD_BT: return Scan::TopFirst;
        case AV_FIELD_BB:
        case AV_FIELD_TB: return Scan::BottomFirst;
        default: return Scan::Unknown;
    }
}

/// The decoder's word on interlacing counts, as it looks at the pictures; which field is first the container may know
/// better, as for DV and ProRes, so that a disagreement is said.
Scan describeScan(const MovieInput& input, const AVFrame* first)
{
    const Scan container = scanOfOrder(input.stream()->codecpar->field_order);
    const Scan decoder = first != nullptr ? scanOf(*first) : Scan::Unknown;
    if (decoder == Scan::Progressive) return isInterlaced(container) ? container : Scan::Progressive;
    if (isInterlaced(container) && isInterlaced(decoder) && container != decoder)
        log::warning("{}: the container says {}, the pictures say {}; the container is believed", input.name(),
                     scanWords(container), scanWords(decoder));
    return isInterlaced(container) || decoder == Scan::Unknown ? container : decoder;
}

/// "h264 yuv420p 1920x1080, eng, 'Camera B', default".
std::string wordsFor(const AVStream& stream)
{
    const AVCodecParameters& p = *stream.codecpar;
    std::string words =
        fmt::format("{} {} {}x{}", avcodec_get_name(p.codec_id), pixelFormatName(p.format), p.width, p.height);
    if (const auto* entry = av_dict_get(stream.metadata, "language", nullptr, 0))
        words += fmt::format(", {}", entry->value);
    if (const auto* entry = av_dict_get(stream.metadata, "title", nullptr, 0))
        words += fmt::format(", '{}'", entry->value);
    if ((stream.disposition & AV_DISPOSITION_DEFAULT) != 0) words += ", default";
    return words;
}

std::string findTimecode(const MovieInput& input)
{
    const auto of = [](const AVDictionary* metadata) -> std::string {
        const AVDictionaryEntry* entry = av_dict_get(metadata, "timecode", nullptr, 0);
        return entry != nullptr ? entry->value : "";
    };
    std::string timecode = of(input.stream()->metadata);
    if (timecode.empty()) timecode = of(input.container()->metadata);
    for (unsigned i = 0; timecode.empty() && i < input.container()->nb_streams; ++i)
        timecode = of(input.container()->streams[i]->metadata);
    return timecode;
}

void describePixels(const MovieInput& input, const AVFrame* first, MovieDescription& movie)
{
    const AVCodecParameters& parameters = *input.stream()->codecpar;
    PlateInfo& info = movie.info;
    MovieOrigin& origin = movie.origin;
    movie.pixelFormat = first != nullptr ? first->format : parameters.format;
    const auto samples = samplesOf(movie.pixelFormat);
    if (!samples)
        throw Error(ErrorCode::Input, "{}: its pixel format {} is not supported", input.name(),
                    pixelFormatName(movie.pixelFormat));
    movie.format = *samples;
    movie.orientation = orientationOf(input.stream(), input.name());
    movie.codedWidth = first != nullptr ? first->width : parameters.width;
    movie.codedHeight = first != nullptr ? first->height : parameters.height;

    info.width = movie.orientation.swap ? movie.codedHeight : movie.codedWidth;
    info.height = movie.orientation.swap ? movie.codedWidth : movie.codedHeight;
    info.hasAlpha = movie.format.hasAlpha;
    info.bitDepth = movie.format.bits;
    info.format = fmt::format("{} {}", avcodec_get_name(parameters.codec_id), pixelFormatName(movie.pixelFormat));
    info.scan = describeScan(input, first);
    origin.fieldOrder = info.scan == Scan::TopFirst      ? AV_FIELD_TT
                        : info.scan == Scan::BottomFirst ? AV_FIELD_BB
                        : info.scan == Scan::Progressive ? AV_FIELD_PROGRESSIVE
                                                         : AV_FIELD_UNKNOWN;

    origin.codecId = parameters.codec_id;
    origin.profile = parameters.profile;
    origin.pixelFormat = withoutRangeName(movie.pixelFormat);
    origin.isTurned = movie.orientation.swap;

    AVRational aspect = av_guess_sample_aspect_ratio(input.container(), input.stream(), nullptr);
    if (aspect.num <= 0 || aspect.den <= 0) aspect = {1, 1};
    if (movie.orientation.swap) std::swap(aspect.num, aspect.den);
    origin.pixelAspect = {aspect.num, aspect.den};
    info.pixelAspect = av_q2d(aspect);
}

/// The container's tags, which an editor sets last; what it leaves open the pictures may say.
void describeTags(const MovieInput& input, const AVFrame* first, MovieDescription& movie)
{
    const AVCodecParameters& parameters = *input.stream()->codecpar;
    MovieOrigin& origin = movie.origin;
    const auto tag = [&](int container, int unspecified, int picture) {
        return container != unspecified || first == nullptr ? container : picture;
    };
    const AVFrame none = {};
    const AVFrame& picture = first != nullptr ? *first : none;
    origin.range = tag(parameters.color_range, AVCOL_RANGE_UNSPECIFIED, picture.color_range);
    origin.primaries = tag(parameters.color_primaries, AVCOL_PRI_UNSPECIFIED, picture.color_primaries);
    origin.transfer = tag(parameters.color_trc, AVCOL_TRC_UNSPECIFIED, picture.color_trc);
    origin.matrix = tag(parameters.color_space, AVCOL_SPC_UNSPECIFIED, picture.colorspace);
    origin.chromaLocation = tag(parameters.chroma_location, AVCHROMA_LOC_UNSPECIFIED, picture.chroma_location);
    if (origin.range == AVCOL_RANGE_UNSPECIFIED) {
        const bool isFull = isFullRangeName(movie.pixelFormat) || movie.format.family != PlanarFormat::Family::Yuv;
        origin.range = isFull ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
        origin.isRangeGuessed = !isFull;
    }
    if (movie.format.family == PlanarFormat::Family::Rgb) {
        origin.matrix = AVCOL_SPC_RGB;
    } else if (origin.matrix == AVCOL_SPC_UNSPECIFIED || origin.matrix == AVCOL_SPC_RESERVED ||
               origin.matrix == AVCOL_SPC_RGB) {
        origin.matrix = guessedMatrix(movie.info.width, movie.info.height);
        origin.isMatrixGuessed = true;
    }
    movie.coding = yuvCoding(origin.matrix, origin.range == AVCOL_RANGE_JPEG, input.name());
    origin.coding = movie.coding;
}

/// Start and duration of every frame; whether they are regular.
void listTimes(const PictureIndex& index, double nominalStep, MovieDescription& movie)
{
    MovieOrigin& origin = movie.origin;
    const std::vector<Picture>& pictures = index.pictures;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        movie.info.frames.push_back(origin.firstFrame + FrameNumber(i));
        FrameTime time{pictures[i].time, pictures[i].duration};
        if (index.countsPictures) time = {std::llround(double(i) * nominalStep), std::llround(nominalStep)};
        origin.times.push_back(time);
        origin.coded.push_back({pictures[i].order, pictures[i].isKey});
    }
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        FrameTime& time = origin.times[i];
        if (i + 1 < pictures.size()) time.duration = origin.times[i + 1].start - time.start;
        if (time.duration <= 0) time.duration = std::max<std::int64_t>(1, std::llround(nominalStep));
        // Containers round time stamps to their time base; more than that is a rate that varies.
        const double regular = double(origin.times[0].start) + double(i) * nominalStep;
        if (std::fabs(double(time.start) - regular) > 1.01) origin.isVariableRate = true;
    }
}

void describeTime(const MovieInput& input, const PictureIndex& index, const ReadOptions& options,
                  MovieDescription& movie)
{
    MovieOrigin& origin = movie.origin;
    const AVFormatContext* container = input.container();
    const AVStream* stream = input.stream();
    origin.timeBase = {stream->time_base.num, stream->time_base.den};
    origin.firstFrame = options.firstFrame.value_or(0);
    const AVRational average = stream->avg_frame_rate;
    AVRational nominal = av_guess_frame_rate(input.container(), input.stream(), nullptr);
    if (nominal.num <= 0 || nominal.den <= 0) nominal = average;
    if (nominal.num <= 0 || nominal.den <= 0) nominal = {24, 1};
    if (container->start_time != AV_NOPTS_VALUE)
        origin.containerStart =
            std::max<std::int64_t>(0, av_rescale_q(container->start_time, AV_TIME_BASE_Q, stream->time_base));
    const double timeBase = av_q2d(stream->time_base);
    listTimes(index, 1 / av_q2d(nominal) / timeBase, movie);

    const double seconds =
        double(origin.times.back().start + origin.times.back().duration - origin.times.front().start) * timeBase;
    AVRational rate = nominal;
    if (origin.isVariableRate && index.pictures.size() > 1)
        rate = average.num > 0 && average.den > 0 ? average : av_d2q(double(index.pictures.size()) / seconds, 1000000);
    if (options.fps) {
        rate = av_d2q(*options.fps, 1000000);
        origin.keepsTime = !origin.isVariableRate && std::fabs(*options.fps - av_q2d(nominal)) < 1e-4 * *options.fps;
    }
    origin.frameRate = {rate.num, rate.den};
    movie.info.fps = options.fps.value_or(av_q2d(rate));
    movie.info.isVariableRate = origin.isVariableRate;
}

/// Pictures are taken whole, as other programs do, and as depth and mattes fit them.
void describeAperture(const MovieInput& input, MovieDescription& movie)
{
    const auto aperture = cleanApertureOf(input.path(), input.container()->iformat->name, *input.stream(),
                                          movie.codedWidth, movie.codedHeight);
    if (!aperture) return;
    movie.info.cleanAperture =
        fmt::format("{:g} x {:g} at {:g},{:g}", aperture->width, aperture->height, aperture->left, aperture->top);
    log::warning(
        "{}: asks to be shown cropped to its clean aperture, {} of {} x {}; it is taken whole, and the result does "
        "not ask for it",
        input.name(), movie.info.cleanAperture, movie.codedWidth, movie.codedHeight);
}

}  // namespace

Scan scanOf(const AVFrame& picture)
{
    if (picture.interlaced_frame == 0) return Scan::Progressive;
    return picture.top_field_first != 0 ? Scan::TopFirst : Scan::BottomFirst;
}

MovieDescription describeMovie(const MovieInput& input, const PictureIndex& index, const AVFrame* first,
                               const ReadOptions& options)
{
    MovieDescription movie;
    movie.info.path = input.name();
    movie.info.isMovie = true;
    for (const int stream : videoStreamsOf(*input.container()))
        movie.info.videoStreams.push_back(wordsFor(*input.container()->streams[stream]));
    movie.origin.isPlain = index.isPlain;
    movie.origin.path = input.path();
    movie.origin.streamIndex = input.streamIndex();
    movie.origin.timecode = findTimecode(input);
    describePixels(input, first, movie);
    describeAperture(input, movie);
    describeTags(input, first, movie);
    describeTime(input, index, options, movie);
    movie.colorClaim = colorClaimOf(movie.origin.transfer, movie.origin.primaries, movie.origin.matrix);
    return movie;
}

}  // namespace virga::io
