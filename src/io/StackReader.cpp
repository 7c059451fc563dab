// Frames that stand top to bottom in one image, as test material and notebooks have them.

#include <algorithm>

#include "core/Error.h"
#include "io/FrameSource.h"

namespace virga::io {

namespace {

class StackSource final : public FrameSource {
public:
    StackSource(const std::string& path, const ReadOptions& options)
    {
        ReadOptions whole = options;
        whole.stack = 0;
        const std::unique_ptr<FrameSource> image = openImages(path, whole);
        info_ = image->info();
        if (!info_.isStill) throw Error(ErrorCode::Input, "{}: a stack of frames is one image, not a pattern", path);
        if (info_.height % options.stack != 0)
            throw Error(ErrorCode::Input, "{}: {} rows cannot be a stack of {} frames", path, info_.height,
                        options.stack);
        stack_ = image->load(info_.frames.front(), Pixels::Light);
        auto extras = std::make_shared<FrameExtras>(*stack_.extras);
        extras->file = {};  // a frame is a piece of it
        stack_.extras = std::move(extras);
        const FrameNumber first = info_.frames.front();
        info_.isStill = false;
        info_.height /= options.stack;
        info_.frames.clear();
        for (int k = 0; k < options.stack; ++k) info_.frames.push_back(first + k);
    }

    const PlateInfo& info() const override { return info_; }
    int parallelLoads() const override { return 2; }

    PlateFrame load(FrameNumber number, Pixels) override
    {
        const FrameNumber k = number - info_.frames.front();
        if (k < 0 || k >= FrameNumber(info_.frames.size()))
            throw Error(ErrorCode::Input, "{}: frame {} is not in the stack, which has {}", info_.path, number,
                        formatFrameRange(info_.frames));
        PlateFrame frame;
        frame.number = number;
        frame.time_s = double(number) / info_.fps;
        frame.pixels = ImageF(info_.width, info_.height, stack_.pixels.channels());
        std::copy_n(stack_.pixels.row(int(k) * info_.height), frame.pixels.size(), frame.pixels.data());
        frame.extras = stack_.extras;
        return frame;
    }

private:
    PlateInfo info_;
    PlateFrame stack_;
};

}  // namespace

std::unique_ptr<FrameSource> openStack(const std::string& path, const ReadOptions& options)
{
    return std::make_unique<StackSource>(path, options);
}

}  // namespace virga::io
