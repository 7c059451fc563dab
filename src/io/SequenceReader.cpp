// Images by frame number: a pattern, or one image that is the only frame.

#include <algorithm>
#include <thread>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ColorConversion.h"
#include "io/FrameSource.h"
#include "io/ImageFile.h"
#include "io/PlateName.h"

namespace virga::io {

namespace {

class SequenceSource final : public FrameSource {
public:
    SequenceSource(const std::string& path, const ReadOptions& options)
        : pattern_(path), choice_{options.layer, options.view}, isColorAsked_(!options.colorspace.empty())
    {
        info_.path = path;
        info_.isStill = !isFramePattern(path);
        info_.frames = info_.isStill
                           ? std::vector<FrameNumber>{options.firstFrame.value_or(frameNumberIn(path).value_or(0))}
                           : findFrames(path);
        if (info_.frames.empty())
            throw Error(ErrorCode::Input, "{}: no file matches, such as {}", path, framePath(path, 1));
        describe(options);
    }

    const PlateInfo& info() const override { return info_; }
    int parallelLoads() const override { return int(std::clamp(std::thread::hardware_concurrency(), 1u, 4u)); }

    PlateFrame load(FrameNumber number, Pixels) override
    {
        if (!std::binary_search(info_.frames.begin(), info_.frames.end(), number))
            throw Error(ErrorCode::Input, "{}: frame {} is missing", pathOf(number), number);
        ImageHeader header;
        PlateFrame frame;
        auto extras = std::make_shared<FrameExtras>();
        frame.number = number;
        frame.time_s = double(number) / info_.fps;
        frame.pixels = readCodedRgba(pathOf(number), header, choice_, &extras->file.overscan);
        refuseOthers(pathOf(number), header);
        codesToLinear(frame.pixels, *toWorking_, header.isStraight, header.hasAlpha);
        if (!extras->file.overscan.empty())
            codesToLinear(extras->file.overscan, *toWorking_, header.isStraight, header.hasAlpha);
        extras->fileFormat = header.format;
        extras->attributes = std::move(header.attributes);
        extras->isGrey = header.picture.isGrey();
        extras->hasAlpha = header.hasAlpha;
        extras->isStraight = header.isStraight;
        extras->bitDepth = header.bitDepth;
        extras->isFloat = header.isFloat;
        extras->file.path = pathOf(number);
        extras->file.part = header.picture.part;
        extras->file.channelNames = header.pictureNames;
        extras->file.data = header.data;
        extras->file.display = header.display;
        frame.extras = std::move(extras);
        return frame;
    }

private:
    std::string pathOf(FrameNumber number) const { return info_.isStill ? pattern_ : framePath(pattern_, number); }

    /// What differs from the first frame and cannot be followed.
    void refuseOthers(const std::string& path, const ImageHeader& header) const
    {
        if (header.width != info_.width || header.height != info_.height)
            throw Error(ErrorCode::Input, "{}: is {}x{}, but the first frame of the sequence is {}x{}", path,
                        header.width, header.height, info_.width, info_.height);
        if (header.hasAlpha && !info_.hasAlpha)
            throw Error(ErrorCode::Input, "{}: has alpha, which the first frame of the sequence has not", path);
        if (header.isFloat != info_.isFloat)
            throw Error(ErrorCode::Input, "{}: holds {}, but the first frame of the sequence {}", path,
                        header.isFloat ? "floating point" : "integers", info_.isFloat ? "floating point" : "integers");
        const auto isSame = [](const ColorClaim& a, const ColorClaim& b) {
            return a.colorspace == b.colorspace && a.source == b.source;
        };
        if (!isColorAsked_ && !std::ranges::equal(header.colorClaims, claims_, isSame)) {
            const ColorClaim claim = chooseColorspace(*info_.colors, "", info_.path, header.colorClaims);
            if (claim.colorspace != info_.colorspace)
                throw Error(ErrorCode::Input,
                            "{}: is in {} ({}), but the first frame of the sequence is in {} ({}); --colorspace says "
                            "one for all",
                            path, claim.colorspace, claim.source, info_.colorspace, info_.colorspaceSource);
        }
    }

    /// Of the first frame, or, if damage is to be survived, of the first whose header can be read.
    ImageHeader firstReadableHeader(OnError onError) const
    {
        if (onError != OnError::Stop)
            for (const FrameNumber frame : info_.frames) {
                try {
                    return readPictureHeader(pathOf(frame), choice_);
                } catch (const Error& error) {
                    if (error.code() != ErrorCode::Input) throw;  // the frame is named again when it is asked for
                }
            }
        return readPictureHeader(pathOf(info_.frames.front()), choice_);
    }

    void describe(const ReadOptions& options)
    {
        const ImageHeader header = firstReadableHeader(options.onError);
        if (!header.orientation.isIdentity())
            log::detail("{}: is {} to be upright, as its header says", info_.path, header.orientation.words());
        info_.layers = header.layers;
        info_.views = header.views;
        info_.beside = header.beside;
        info_.hasOverscan = !header.display.contains(header.data);
        if (info_.hasOverscan) {
            const Window &data = header.data, &display = header.display;
            info_.overscanX =
                std::clamp(std::max(display.x - data.x, data.right() - display.right()), 0, display.width);
            info_.overscanY =
                std::clamp(std::max(display.y - data.y, data.bottom() - display.bottom()), 0, display.height);
        }
        info_.width = header.width;
        info_.height = header.height;
        info_.pixelAspect = header.pixelAspect;
        info_.hasAlpha = header.hasAlpha;
        info_.bitDepth = header.bitDepth;
        info_.isFloat = header.isFloat;
        info_.format = fmt::format("{} {}", header.format,
                                   !header.isFloat         ? fmt::format("{} bit", header.bitDepth)
                                   : header.bitDepth == 16 ? "half"
                                                           : "float");
        info_.fps = options.fps.value_or(header.fps > 0 ? header.fps : 24);
        claims_ = header.colorClaims;
        toWorking_ = describeColor(info_, options, header.colorClaims);
    }

    std::string pattern_;
    PictureChoice choice_;
    bool isColorAsked_;
    std::vector<ColorClaim> claims_;  // of the first frame
    PlateInfo info_;
    std::shared_ptr<const ColorTransform> toWorking_;
};

}  // namespace

std::unique_ptr<FrameSource> openImages(const std::string& path, const ReadOptions& options)
{
    return std::make_unique<SequenceSource>(path, options);
}

}  // namespace virga::io
