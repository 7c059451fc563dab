// Movies by frame number: the container (MovieInput), which pictures it has (PictureIndex), the decoded picture with a
// number (MovieDecoder), what all that is (MovieDescription), put together into plate frames.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/imgutils.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cstring>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ColorConversion.h"
#include "io/Deinterlacer.h"
#include "io/FrameSource.h"
#include "io/MovieDecoder.h"
#include "io/MovieDescription.h"
#include "io/MovieRows.h"

namespace virga::io {

using namespace libav;

namespace {

/// Whether two pictures of a movie are the same, code for code. Pictures that differ mostly do so in the first rows.
bool haveSameCodes(const AVFrame& a, const AVFrame& b)
{
    const auto format = AVPixelFormat(a.format);
    const AVPixFmtDescriptor* description = av_pix_fmt_desc_get(format);
    if (a.format != b.format || a.width != b.width || a.height != b.height || description == nullptr) return false;
    if (description->flags & (AV_PIX_FMT_FLAG_PAL | AV_PIX_FMT_FLAG_HWACCEL)) return false;
    for (int plane = 0; plane < av_pix_fmt_count_planes(format); ++plane) {
        const bool isChroma = plane == 1 || plane == 2;
        const int rows = isChroma ? AV_CEIL_RSHIFT(a.height, description->log2_chroma_h) : a.height;
        const int bytes = av_image_get_linesize(format, a.width, plane);
        for (int y = 0; y < rows; ++y)
            if (std::memcmp(a.data[plane] + std::ptrdiff_t(y) * a.linesize[plane],
                            b.data[plane] + std::ptrdiff_t(y) * b.linesize[plane], std::size_t(bytes)) != 0)
                return false;
    }
    return true;
}

class MovieSource final : public FrameSource {
public:
    MovieSource(const std::string& path, const ReadOptions& options)
        : input_(path, options.stream), index_(listPictures(input_)),
          decoder_(input_, index_, options.firstFrame.value_or(0)),
          movie_(describeMovie(input_, index_, firstPicture().get(), options)),
          toWorking_(describeColor(movie_.info, options, {movie_.colorClaim})), timeline_(options.timeline)
    {
        if (options.deinterlace)
            deinterlace();
        else if (isInterlaced(movie_.info.scan))
            log::warning(
                "{}: is {}; the two fields of a frame are treated as one picture (--deinterlace makes one "
                "of them)",
                input_.name(), scanWords(movie_.info.scan));
    }

    const PlateInfo& info() const override { return movie_.info; }
    const MovieOrigin* movie() const override { return &movie_.origin; }

    /// Rows of fields are not interpolated: neighbours belong to different times.
    void fitChroma(SharedChroma result) override
    {
        if (movie_.orientation.swap) std::swap(result.shiftX, result.shiftY);
        const bool hasFields = isInterlaced(movie_.info.scan) && !deinterlacer_;
        chroma_ = chromaSites(movie_.origin.chromaLocation);
        chroma_.x.isInterpolated = movie_.format.chromaShiftX > result.shiftX;
        chroma_.y.isInterpolated = movie_.format.chromaShiftY > result.shiftY && !hasFields;
    }

    PlateFrame load(FrameNumber number, Pixels pixels) override
    {
        const MovieOrigin& origin = movie_.origin;
        const FrameNumber index = number - origin.firstFrame;
        if (index < 0 || index >= FrameNumber(index_.pictures.size()))
            throw Error(ErrorCode::Input, "{}: has no frame {}; it has {}-{}", input_.name(), number,
                        movie_.info.frames.front(), movie_.info.frames.back());
        PlateFrame frame;
        frame.number = number;
        frame.time_s = origin.keepsTime ? double(origin.times[std::size_t(index)].start - origin.times[0].start) *
                                              origin.timeBase.value()
                                        : double(index) / movie_.info.fps;
        Frame decoded = [&] {
            const StageSpan span(timeline_, "reader", "decode", number);
            return picture(std::size_t(index));
        }();
        if (!last_ || !haveSameCodes(*last_, *decoded)) ++content_;
        last_.reset(av_frame_clone(decoded.get()));
        frame.content = content_;
        auto extras = std::make_shared<FrameExtras>();
        const bool isUpright = movie_.orientation.isIdentity();
        if (pixels == Pixels::Codes && isUpright)
            extras->codes = std::move(decoded);
        else if (pixels == Pixels::Rows && isUpright && isPlanar(decoded->format))
            frame.rows = std::make_shared<DecodedRows>(
                std::move(decoded), PlanesOfLight{movie_.format, movie_.coding, toWorking_, chroma_});
        else {
            const StageSpan span(timeline_, "reader", "convert", number);
            frame.pixels = convert(*decoded);
        }
        frame.extras = std::move(extras);
        return frame;
    }

private:
    /// The first picture that can be decoded, of the first few; null if they are all damaged.
    Frame firstPicture()
    {
        const std::size_t few = std::min<std::size_t>(index_.pictures.size(), 8);
        for (std::size_t i = 0; i < few; ++i) {
            try {
                return decoder_.picture(i);
            } catch (const Error&) {  // asked for again, it will be named
            }
        }
        return nullptr;
    }

    void deinterlace()
    {
        if (!isInterlaced(movie_.info.scan)) {
            log::warning("{}: --deinterlace: its scan is {}; it is left as it is", input_.name(),
                         scanWords(movie_.info.scan));
            return;
        }
        deinterlacer_.emplace(input_.name(), movie_.pixelFormat, movie_.codedWidth, movie_.codedHeight,
                              movie_.info.scan);
        movie_.info.isDeinterlaced = true;
        movie_.origin.fieldOrder = AV_FIELD_PROGRESSIVE;
    }

    /// As decoded, or made of its own and its neighbours' fields. At the ends, and beside a damaged picture, there is
    /// one neighbour only, or none.
    Frame picture(std::size_t index)
    {
        const auto neighbour = [&](std::size_t at) -> Frame {
            try {
                Frame frame = decoder_.picture(at);
                return isLikeTheFirst(*frame) ? std::move(frame) : nullptr;
            } catch (const Error&) {
                return nullptr;
            }
        };
        if (!deinterlacer_) {
            Frame frame = decoder_.picture(index);
            checkIsLikeTheFirst(*frame, index);
            warnOfFields(*frame, index);
            return frame;
        }
        const Frame before = index > 0 ? neighbour(index - 1) : nullptr;
        const Frame frame = decoder_.picture(index);
        checkIsLikeTheFirst(*frame, index);
        const Frame after = index + 1 < index_.pictures.size() ? neighbour(index + 1) : nullptr;
        return deinterlacer_->picture(before.get(), *frame, after.get());
    }

    bool isLikeTheFirst(const AVFrame& picture) const
    {
        return picture.width == movie_.codedWidth && picture.height == movie_.codedHeight &&
               withoutRangeName(picture.format) == movie_.origin.pixelFormat;
    }

    void checkIsLikeTheFirst(const AVFrame& picture, std::size_t index) const
    {
        if (isLikeTheFirst(picture)) return;
        const FrameNumber number = movie_.origin.firstFrame + FrameNumber(index);
        if (picture.width != movie_.codedWidth || picture.height != movie_.codedHeight)
            throw Error(ErrorCode::Input, "{}: frame {} is {}x{}, the movie began with {}x{}", input_.name(), number,
                        picture.width, picture.height, movie_.codedWidth, movie_.codedHeight);
        throw Error(ErrorCode::Input, "{}: frame {} is {}, the movie began with {}", input_.name(), number,
                    pixelFormatName(picture.format), pixelFormatName(movie_.pixelFormat));
    }

    /// Once: of pictures with fields in a movie that began without.
    void warnOfFields(const AVFrame& picture, std::size_t index)
    {
        if (saidFields_ || isInterlaced(movie_.info.scan) || !isInterlaced(scanOf(picture))) return;
        saidFields_ = true;
        log::warning("{}: frame {} is {}, the movie began {}; the two fields are treated as one picture", input_.name(),
                     movie_.origin.firstFrame + FrameNumber(index), scanWords(scanOf(picture)),
                     scanWords(movie_.info.scan));
    }

    ImageF convert(const AVFrame& decoded)
    {
        PlanarPicture picture = planesOf(decoded);
        if (!isPlanar(decoded.format)) {
            if (!unpacked_)
                unpacked_ = std::make_unique<PlanarBuffer>(movie_.format, movie_.codedWidth, movie_.codedHeight);
            picture = unpacked_->picture();
            unpack(decoded, movie_.format, picture);
        }
        ImageF coded(movie_.codedWidth, movie_.codedHeight, 4);
        planarToLinear(movie_.format, movie_.coding, asConst(picture), *toWorking_, coded, chroma_);
        if (movie_.orientation.isIdentity()) return coded;
        ImageF shown(movie_.info.width, movie_.info.height, 4);
        orient(coded, movie_.orientation, shown);
        return shown;
    }

    MovieInput input_;
    PictureIndex index_;
    MovieDecoder decoder_;
    MovieDescription movie_;
    std::shared_ptr<const ColorTransform> toWorking_;
    Timeline* timeline_;
    std::optional<Deinterlacer> deinterlacer_;
    ChromaFilter chroma_;
    std::unique_ptr<PlanarBuffer> unpacked_;  // for formats that are not planar
    bool saidFields_ = false;
    Frame last_;  // the picture that was loaded last
    std::uint64_t content_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> openMovie(const std::string& path, const ReadOptions& options)
{
    return std::make_unique<MovieSource>(path, options);
}

}  // namespace virga::io
