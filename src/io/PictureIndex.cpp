#include "io/PictureIndex.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <algorithm>
#include <cstring>
#include <set>

#include "core/Error.h"
#include "core/Log.h"
#include "io/Ffv1Checksum.h"

namespace virga::io {

namespace {

/// Whether the packet gives a picture. Edit lists mark what is not shown; VP8 has frames that only serve others
/// (RFC 6386, 9.1: bit 4 of the first byte is show_frame).
bool isShown(const AVPacket& packet, AVCodecID codec)
{
    if ((packet.flags & AV_PKT_FLAG_DISCARD) != 0) return false;
    return codec != AV_CODEC_ID_VP8 || (packet.data[0] & 0x10) != 0;
}

/// Whether time stamps name pictures: they begin anew where files were joined, and some writers repeat them. Two
/// packets of one time are no fault where the codec may code the two fields of a picture apart.
bool areTimesUsable(const std::vector<Picture>& inFileOrder, const AVCodecParameters& parameters)
{
    for (std::size_t i = 1; i < inFileOrder.size(); ++i) {
        const std::int64_t before = inFileOrder[i - 1].decodeTime, now = inFileOrder[i].decodeTime;
        if (before != AV_NOPTS_VALUE && now != AV_NOPTS_VALUE && now < before) return false;
    }
    static constexpr AVCodecID withFields[] = {AV_CODEC_ID_MPEG2VIDEO, AV_CODEC_ID_H264, AV_CODEC_ID_HEVC,
                                               AV_CODEC_ID_VC1, AV_CODEC_ID_JPEG2000};
    const bool mayHaveFields =
        std::find(std::begin(withFields), std::end(withFields), parameters.codec_id) != std::end(withFields) &&
        parameters.field_order != AV_FIELD_PROGRESSIVE;
    if (mayHaveFields) return true;
    std::set<std::int64_t> times;
    return std::all_of(inFileOrder.begin(), inFileOrder.end(),
                       [&](const Picture& picture) { return times.insert(picture.time).second; });
}

/// MXF files without an index of the pictures' order have time stamps in the order of decoding, which name no picture.
bool isInDecodingOrder(const MovieInput& input, const std::vector<Picture>& inFileOrder)
{
    return std::strcmp(input.container()->iformat->name, "mxf") == 0 && input.stream()->codecpar->video_delay > 0 &&
           std::all_of(inFileOrder.begin(), inFileOrder.end(),
                       [](const Picture& picture) { return picture.time == picture.decodeTime; });
}

/// Pictures that an edit list hides are counted in the header, but not shown.
bool hasEditList(const MovieInput& input)
{
    return std::strstr(input.container()->iformat->name, "mov") != nullptr && input.stream()->start_time != 0;
}

}  // namespace

const Picture* PictureIndex::keyFor(std::size_t index, int earlier) const
{
    for (std::size_t i = index + 1; i-- > 0;)
        if (pictures[i].isKey && earlier-- == 0) return &pictures[i];
    return nullptr;
}

std::size_t PictureIndex::lastBuiltOn(std::size_t index) const
{
    std::size_t next = index + 1;
    while (next < pictures.size() && !pictures[next].isKey) ++next;
    return next - 1;
}

PictureIndex listPictures(MovieInput& input)
{
    const AVCodecParameters& parameters = *input.stream()->codecpar;
    const bool mayReorder = parameters.video_delay > 0;
    PictureIndex index;
    std::vector<Picture>& pictures = index.pictures;
    bool hidesPictures = false;
    for (const libav::Packet packet = libav::makePacket(); input.read(*packet); av_packet_unref(packet.get())) {
        if (!isShown(*packet, parameters.codec_id)) {
            hidesPictures = true;
            index.isPlain = false;
            continue;
        }
        Picture picture;
        picture.decodeTime = packet->dts;
        picture.time = packet->pts != AV_NOPTS_VALUE || mayReorder ? packet->pts : packet->dts;
        picture.duration = packet->duration;
        picture.order = pictures.size();
        picture.isKey = (packet->flags & AV_PKT_FLAG_KEY) != 0;
        picture.isDamaged = (packet->flags & AV_PKT_FLAG_CORRUPT) != 0;
        index.isPlain = index.isPlain && !picture.isDamaged;
        if (picture.time == AV_NOPTS_VALUE) index.countsPictures = true;
        if (parameters.codec_id == AV_CODEC_ID_FFV1 && pictures.size() < 4)
            index.hasChecksums =
                index.hasChecksums || checkFfv1Packet(packet->data, std::size_t(packet->size)) != Ffv1Checksum::Absent;
        pictures.push_back(picture);
    }
    if (pictures.empty())
        throw Error(ErrorCode::Input, "{}: holds no picture; the file is damaged or cut off", input.name());
    if (input.stream()->nb_frames > std::int64_t(pictures.size()) && !hidesPictures && !hasEditList(input))
        log::warning("{}: is cut off: its header promises {} frames, {} are there", input.name(),
                     input.stream()->nb_frames, pictures.size());
    if (isInDecodingOrder(input, pictures)) {
        index.countsPictures = true;
    } else if (!index.countsPictures && !areTimesUsable(pictures, parameters)) {
        log::warning("{}: its time stamps begin anew or repeat; its {} pictures are counted instead", input.name(),
                     pictures.size());
        index.countsPictures = true;
    }
    if (index.countsPictures) {
        for (std::size_t i = 0; i < pictures.size(); ++i) pictures[i].time = std::int64_t(i);
        index.isPlain = false;
        return index;
    }
    std::stable_sort(pictures.begin(), pictures.end(),
                     [](const Picture& a, const Picture& b) { return a.time < b.time; });
    // The second field of a picture may come in a packet of its own.
    const auto twins = std::unique(pictures.begin(), pictures.end(),
                                   [](const Picture& a, const Picture& b) { return a.time == b.time; });
    index.isPlain = index.isPlain && twins == pictures.end();
    pictures.erase(twins, pictures.end());
    return index;
}

}  // namespace virga::io
