#include "io/MovieFacts.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/dovi_meta.h>
#include <libavutil/mastering_display_metadata.h>
#include <libavutil/pixdesc.h>
}

#include "io/FrameSource.h"
#include "io/MovieMetadata.h"
#include "io/Orientation.h"

namespace virga::io {

using namespace libav;

namespace {

std::string textOf(const char* name) { return name != nullptr ? name : ""; }

std::string entryOf(const AVDictionary* metadata, const char* key)
{
    const AVDictionaryEntry* entry = av_dict_get(metadata, key, nullptr, 0);
    return entry != nullptr ? entry->value : "";
}

void addTags(const MovieOrigin& origin, MovieFacts& facts)
{
    facts.isRangeGuessed = origin.isRangeGuessed;
    facts.isMatrixGuessed = origin.isMatrixGuessed;
    facts.range = origin.range == AVCOL_RANGE_JPEG ? "full" : "limited";
    facts.matrix = textOf(av_color_space_name(AVColorSpace(origin.matrix)));
    if (origin.primaries != AVCOL_PRI_UNSPECIFIED)
        facts.primaries = textOf(av_color_primaries_name(AVColorPrimaries(origin.primaries)));
    if (origin.transfer != AVCOL_TRC_UNSPECIFIED)
        facts.transfer = textOf(av_color_transfer_name(AVColorTransferCharacteristic(origin.transfer)));
    if (origin.chromaLocation != AVCHROMA_LOC_UNSPECIFIED)
        facts.chromaLocation = textOf(av_chroma_location_name(AVChromaLocation(origin.chromaLocation)));
}

/// Nothing for further pictures, which PlateInfo lists.
std::optional<MovieFacts::Stream> streamFacts(const AVStream& stream)
{
    const AVCodecParameters& p = *stream.codecpar;
    MovieFacts::Stream facts;
    switch (p.codec_type) {
        case AVMEDIA_TYPE_AUDIO: facts.kind = "sound"; break;
        case AVMEDIA_TYPE_SUBTITLE: facts.kind = "subtitles"; break;
        case AVMEDIA_TYPE_ATTACHMENT: facts.kind = "attachment"; break;
        case AVMEDIA_TYPE_VIDEO:
            if ((stream.disposition & AV_DISPOSITION_ATTACHED_PIC) == 0) return std::nullopt;
            facts.kind = "cover";
            break;
        default: facts.kind = "data"; break;
    }
    char tag[AV_FOURCC_MAX_STRING_SIZE] = {};
    facts.codec = p.codec_id != AV_CODEC_ID_NONE ? avcodec_get_name(p.codec_id)
                  : p.codec_tag != 0             ? av_fourcc_make_string(tag, p.codec_tag)
                                                 : "";
    facts.language = entryOf(stream.metadata, "language");
    if (facts.language == "und") facts.language.clear();  // ISO 639-2: undetermined
    facts.title = entryOf(stream.metadata, p.codec_type == AVMEDIA_TYPE_ATTACHMENT ? "filename" : "title");
    if (p.codec_type == AVMEDIA_TYPE_AUDIO) {
        facts.channels = p.ch_layout.nb_channels;
        facts.rate = p.sample_rate;
    }
    if (stream.start_time != AV_NOPTS_VALUE) facts.start = double(stream.start_time) * av_q2d(stream.time_base);
    return facts;
}

void addHdr(AVFormatContext& movie, int streamIndex, MovieFacts& facts)
{
    const HdrMetadata hdr = readHdrMetadata(movie, streamIndex);
    if (hdr.masteringDisplay.size() >= sizeof(AVMasteringDisplayMetadata)) {
        const auto& m = *reinterpret_cast<const AVMasteringDisplayMetadata*>(hdr.masteringDisplay.data());
        MovieFacts::MasteringDisplay display{};
        for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t i = 0; i < 2; ++i)
                display.chromaticities[c][i] = av_q2d(c < 3 ? m.display_primaries[c][i] : m.white_point[i]);
        display.least = av_q2d(m.min_luminance);
        display.most = av_q2d(m.max_luminance);
        if (m.has_primaries != 0 && m.has_luminance != 0) facts.masteringDisplay = display;
    }
    if (hdr.lightLevel.size() >= sizeof(AVContentLightMetadata)) {
        const auto& light = *reinterpret_cast<const AVContentLightMetadata*>(hdr.lightLevel.data());
        facts.lightLevel = {light.MaxCLL, light.MaxFALL};
    }
    std::size_t size = 0;
    const std::uint8_t* dovi = av_stream_get_side_data(movie.streams[streamIndex], AV_PKT_DATA_DOVI_CONF, &size);
    if (dovi != nullptr && size >= sizeof(AVDOVIDecoderConfigurationRecord))
        facts.dolbyVisionProfile = reinterpret_cast<const AVDOVIDecoderConfigurationRecord*>(dovi)->dv_profile;
}

}  // namespace

std::optional<MovieFacts> movieFacts(const PlateReader& plate)
{
    const MovieOrigin* origin = originOf(plate);
    if (origin == nullptr) return std::nullopt;
    MovieFacts facts;
    addTags(*origin, facts);
    facts.timecode = origin->timecode;
    const Input movie = openPlateMovie(origin->path);
    if (!movie) return facts;
    facts.orientation = orientationOf(movie->streams[origin->streamIndex], plate.info().path).words();
    for (unsigned i = 0; i < movie->nb_streams; ++i)
        if (auto stream = streamFacts(*movie->streams[i])) facts.streams.push_back(std::move(*stream));
    for (unsigned i = 0; i < movie->nb_chapters; ++i) {
        const AVChapter& chapter = *movie->chapters[i];
        const double tick = av_q2d(chapter.time_base);
        facts.chapters.push_back(
            {double(chapter.start) * tick, double(chapter.end) * tick, entryOf(chapter.metadata, "title")});
    }
    addHdr(*movie, origin->streamIndex, facts);
    return facts;
}

}  // namespace virga::io
