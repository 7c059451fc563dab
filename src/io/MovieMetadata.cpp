#include "io/MovieMetadata.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/mastering_display_metadata.h>
#include <libavutil/mathematics.h>
#include <libavutil/timecode.h>
}

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <set>

#include "core/Error.h"

namespace virga::io {

using namespace libav;

Input openPlateMovie(const std::string& path)
{
    AVFormatContext* context = nullptr;
    if (avformat_open_input(&context, urlOf(path).c_str(), nullptr, nullptr) < 0) return {};
    Input input(context);
    if (avformat_find_stream_info(context, nullptr) < 0) return {};
    return input;
}

namespace {

bool isKept(const char* key)
{
    static const std::set<std::string> own = {
        "major_brand", "minor_version", "compatible_brands", "encoder", "timecode", "duration", "rotate", "vendor_id"};
    std::string lower = key;
    std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
    return !own.contains(lower) && !lower.starts_with("_statistics") && lower != "bps" &&
           !lower.starts_with("number_of_");
}

void copyKept(const AVDictionary* from, AVDictionary** to)
{
    const AVDictionaryEntry* entry = nullptr;
    while ((entry = av_dict_get(from, "", entry, AV_DICT_IGNORE_SUFFIX)) != nullptr)
        if (isKept(entry->key)) av_dict_set(to, entry->key, entry->value, 0);
}

void addSideData(AVStream& stream, AVPacketSideDataType type, const std::uint8_t* data, std::size_t size)
{
    std::uint8_t* copy = av_stream_new_side_data(&stream, type, size);
    if (copy == nullptr) throw std::bad_alloc();
    std::memcpy(copy, data, size);
}

}  // namespace

void copyFileMetadata(const AVFormatContext& from, AVFormatContext& to) { copyKept(from.metadata, &to.metadata); }

void copyStreamMetadata(const AVStream& from, AVStream& to)
{
    copyKept(from.metadata, &to.metadata);
    av_dict_set(&to.metadata, "creation_time", nullptr, 0);  // the file's holds
}

void copySideData(const AVStream& from, AVStream& to)
{
    for (int i = 0; i < from.nb_side_data; ++i)
        addSideData(to, from.side_data[i].type, from.side_data[i].data, from.side_data[i].size);
}

void copyChapters(const AVFormatContext& from, AVFormatContext& to, double start, std::optional<double> end)
{
    constexpr AVRational milliseconds{1, 1000};
    std::vector<AVChapter*> chapters;
    for (unsigned i = 0; i < from.nb_chapters; ++i) {
        const AVChapter& chapter = *from.chapters[i];
        const double timeBase = av_q2d(chapter.time_base);
        const double first = std::max(double(chapter.start) * timeBase, start);
        const double last = end ? std::min(double(chapter.end) * timeBase, *end) : double(chapter.end) * timeBase;
        // A chapter of which less than a tick is left has nothing to show.
        if (last - first < 1e-3) continue;
        auto* copy = static_cast<AVChapter*>(av_mallocz(sizeof(AVChapter)));
        if (copy == nullptr) throw std::bad_alloc();
        copy->id = chapter.id;
        copy->time_base = milliseconds;
        copy->start = std::llround((first - start) * 1000);
        copy->end = std::llround((last - start) * 1000);
        av_dict_copy(&copy->metadata, chapter.metadata, 0);
        chapters.push_back(copy);
    }
    if (chapters.empty()) return;
    to.chapters = static_cast<AVChapter**>(av_malloc_array(chapters.size(), sizeof(AVChapter*)));
    if (to.chapters == nullptr) throw std::bad_alloc();
    std::copy(chapters.begin(), chapters.end(), to.chapters);
    to.nb_chapters = unsigned(chapters.size());
}

std::optional<std::string> timecodeAfter(const std::string& start, Rational frameRate, std::int64_t frames)
{
    AVTimecode timecode;
    if (av_timecode_init_from_string(&timecode, {frameRate.num, frameRate.den}, start.c_str(), nullptr) < 0) return {};
    char text[AV_TIMECODE_STR_SIZE];
    return av_timecode_make_string(&timecode, text, int(frames));
}

namespace {

template <class Structure>
const Structure* as(const std::vector<std::uint8_t>& bytes)
{
    return bytes.size() >= sizeof(Structure) ? reinterpret_cast<const Structure*>(bytes.data()) : nullptr;
}

std::vector<std::uint8_t> ofStream(const AVStream& stream, AVPacketSideDataType type)
{
    std::size_t size = 0;
    const std::uint8_t* data = av_stream_get_side_data(&stream, type, &size);
    return data != nullptr ? std::vector<std::uint8_t>(data, data + size) : std::vector<std::uint8_t>();
}

std::vector<std::uint8_t> ofFrame(const AVFrame& frame, AVFrameSideDataType type)
{
    const AVFrameSideData* data = av_frame_get_side_data(&frame, type);
    return data != nullptr ? std::vector<std::uint8_t>(data->data, data->data + data->size)
                           : std::vector<std::uint8_t>();
}

/// The first picture that decodes, or null.
Frame firstPicture(AVFormatContext& movie, int streamIndex)
{
    const AVCodecParameters* parameters = movie.streams[streamIndex]->codecpar;
    const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
    const Codec decoder(codec != nullptr ? avcodec_alloc_context3(codec) : nullptr);
    if (!decoder || avcodec_parameters_to_context(decoder.get(), parameters) < 0 ||
        avcodec_open2(decoder.get(), codec, nullptr) < 0)
        return {};
    Frame frame = makeFrame();
    const Packet packet = makePacket();
    constexpr int most = 200;  // packets; a movie whose pictures do not decode is not searched whole
    for (int i = 0; i < most && av_read_frame(&movie, packet.get()) >= 0; ++i) {
        if (packet->stream_index == streamIndex) avcodec_send_packet(decoder.get(), packet.get());
        av_packet_unref(packet.get());
        if (avcodec_receive_frame(decoder.get(), frame.get()) >= 0) return frame;
    }
    avcodec_send_packet(decoder.get(), nullptr);
    return avcodec_receive_frame(decoder.get(), frame.get()) >= 0 ? std::move(frame) : Frame();
}

}  // namespace

HdrMetadata readHdrMetadata(AVFormatContext& plate, int streamIndex)
{
    const AVStream& stream = *plate.streams[streamIndex];
    HdrMetadata metadata{ofStream(stream, AV_PKT_DATA_MASTERING_DISPLAY_METADATA),
                         ofStream(stream, AV_PKT_DATA_CONTENT_LIGHT_LEVEL)};
    const AVCodecID codec = stream.codecpar->codec_id;
    if (!metadata.isEmpty() || (codec != AV_CODEC_ID_HEVC && codec != AV_CODEC_ID_AV1 && codec != AV_CODEC_ID_H264))
        return metadata;
    if (const Frame frame = firstPicture(plate, streamIndex)) {
        metadata.masteringDisplay = ofFrame(*frame, AV_FRAME_DATA_MASTERING_DISPLAY_METADATA);
        metadata.lightLevel = ofFrame(*frame, AV_FRAME_DATA_CONTENT_LIGHT_LEVEL);
    }
    return metadata;
}

void addHdrMetadata(const HdrMetadata& metadata, AVStream& stream)
{
    if (!metadata.masteringDisplay.empty())
        addSideData(stream, AV_PKT_DATA_MASTERING_DISPLAY_METADATA, metadata.masteringDisplay.data(),
                    metadata.masteringDisplay.size());
    if (!metadata.lightLevel.empty())
        addSideData(stream, AV_PKT_DATA_CONTENT_LIGHT_LEVEL, metadata.lightLevel.data(), metadata.lightLevel.size());
}

std::vector<std::string> x265HdrParameters(const HdrMetadata& metadata)
{
    std::vector<std::string> result;
    if (const auto* m = as<AVMasteringDisplayMetadata>(metadata.masteringDisplay);
        m != nullptr && m->has_primaries != 0 && m->has_luminance != 0) {
        // SEI units (ITU-T H.265, D.3.28): chromaticity in 0.00002, luminance in 0.0001 cd/m2.
        const auto place = [](const AVRational(&xy)[2]) {
            return fmt::format("({},{})", std::lround(av_q2d(xy[0]) * 50000), std::lround(av_q2d(xy[1]) * 50000));
        };
        const auto& p = m->display_primaries;
        result.push_back(fmt::format("master-display=G{}B{}R{}WP{}L({},{})", place(p[1]), place(p[2]), place(p[0]),
                                     place(m->white_point), std::lround(av_q2d(m->max_luminance) * 10000),
                                     std::lround(av_q2d(m->min_luminance) * 10000)));
    }
    if (const auto* light = as<AVContentLightMetadata>(metadata.lightLevel))
        result.push_back(fmt::format("max-cll={},{}", light->MaxCLL, light->MaxFALL));
    if (!result.empty()) result.push_back("hdr10=1");
    return result;
}

std::vector<std::string> svtAv1HdrParameters(const HdrMetadata& metadata)
{
    std::vector<std::string> result;
    if (const auto* m = as<AVMasteringDisplayMetadata>(metadata.masteringDisplay);
        m != nullptr && m->has_primaries != 0 && m->has_luminance != 0) {
        const auto place = [](const AVRational(&xy)[2]) {
            return fmt::format("({:.5f},{:.5f})", av_q2d(xy[0]), av_q2d(xy[1]));
        };
        const auto& p = m->display_primaries;
        result.push_back(fmt::format("mastering-display=G{}B{}R{}WP{}L({:.4f},{:.4f})", place(p[1]), place(p[2]),
                                     place(p[0]), place(m->white_point), av_q2d(m->max_luminance),
                                     av_q2d(m->min_luminance)));
    }
    if (const auto* light = as<AVContentLightMetadata>(metadata.lightLevel))
        result.push_back(fmt::format("content-light={},{}", light->MaxCLL, light->MaxFALL));
    return result;
}

}  // namespace virga::io
