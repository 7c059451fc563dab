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
    SequenceSource(const std::string& path, const ReadOptions& options) : pattern_(path), layer_(options.layer)
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
        frame.number = number;
        frame.time_s = double(number) / info_.fps;
        frame.pixels = readCodedRgba(pathOf(number), header, layer_);
        if (header.width != info_.width || header.height != info_.height)
            throw Error(ErrorCode::Input, "{}: is {}x{}, but the first frame of the sequence is {}x{}", pathOf(number),
                        header.width, header.height, info_.width, info_.height);
        codesToLinear(frame.pixels, *toWorking_, header.isStraight, header.hasAlpha);
        auto extras = std::make_shared<FrameExtras>();
        extras->fileFormat = header.format;
        extras->attributes = std::move(header.attributes);
        frame.extras = std::move(extras);
        return frame;
    }

private:
    std::string pathOf(FrameNumber number) const { return info_.isStill ? pattern_ : framePath(pattern_, number); }

    /// Of the first frame, or, if damage is to be survived, of the first whose header can be read.
    ImageHeader firstReadableHeader(OnError onError) const
    {
        if (onError != OnError::Stop)
            for (const FrameNumber frame : info_.frames) {
                try {
                    return readPictureHeader(pathOf(frame), layer_);
                } catch (const Error& error) {
                    if (error.code() != ErrorCode::Input) throw;  // the frame is named again when it is asked for
                }
            }
        return readPictureHeader(pathOf(info_.frames.front()), layer_);
    }

    void describe(const ReadOptions& options)
    {
        const ImageHeader header = firstReadableHeader(options.onError);
        for (const std::string& sentence : header.leftOut) log::warning("{}", sentence);
        info_.layers = header.layers;
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
        toWorking_ = describeColor(info_, options, header.colorClaims);
    }

    std::string pattern_, layer_;
    PlateInfo info_;
    std::shared_ptr<const ColorTransform> toWorking_;
};

}  // namespace

std::unique_ptr<FrameSource> openImages(const std::string& path, const ReadOptions& options)
{
    return std::make_unique<SequenceSource>(path, options);
}

}  // namespace virga::io
