#include "shot/DepthSource.h"

#include <algorithm>
#include <charconv>

#include "core/Error.h"
#include "core/Log.h"
#include "depth/Geometry.h"
#include "shot/Doubts.h"

namespace virga::shot {

Ground parseGround(const std::string& text)
{
    const auto fail = [&]() -> Ground {
        throw Error(ErrorCode::InvalidArgument,
                    "--ground '{}': must be height[,pitch], the camera's height over 0 to 10000 m and its pitch down "
                    "between -90 and 90 deg",
                    text);
    };
    Ground ground{0, 0};
    const char* const last = text.data() + text.size();
    auto [end, error] = std::from_chars(text.data(), last, ground.height_m);
    if (error != std::errc()) return fail();
    if (end != last) {
        if (*end != ',') return fail();
        const auto pitch = std::from_chars(end + 1, last, ground.pitch_deg);
        if (pitch.ec != std::errc() || pitch.ptr != last) return fail();
    }
    if (!(ground.height_m > 0 && ground.height_m <= 1e4) || !(ground.pitch_deg > -90 && ground.pitch_deg < 90))
        return fail();
    return ground;
}

namespace {

depth::DepthKind kindOf(const Settings& s)
{
    if (s.depthInvert && s.depthKind != "z" && s.depthKind != "inverse")
        throw Error(ErrorCode::InvalidArgument, "--depth-invert and --depth-kind {} exclude each other", s.depthKind);
    if (s.depthInvert || s.depthKind == "inverse") return depth::DepthKind::Inverse;
    if (s.depthKind == "distance") return depth::DepthKind::Distance;
    return s.depthKind == "disparity" ? depth::DepthKind::Disparity : depth::DepthKind::Z;
}

/// A part of the image, which goes on beyond its borders as it is there.
ImageF partOf(const ImageF& image, const Window& region)
{
    ImageF part(region.width, region.height, 1);
    for (int y = 0; y < part.height(); ++y) {
        const float* from = image.row(std::clamp(y + region.y, 0, image.height() - 1));
        for (int x = 0; x < part.width(); ++x) part.at(x, y) = from[std::clamp(x + region.x, 0, image.width() - 1)];
    }
    return part;
}

}  // namespace

depth::DepthOptions depthOptionsOf(const Settings& settings)
{
    depth::DepthOptions options;
    options.kind = kindOf(settings);
    options.scale = settings.depthScale;
    options.offset = settings.depthOffset;
    options.noValue = settings.depthNoValue;
    options.baseline_m = settings.depthBaseline_m;
    if (options.kind == depth::DepthKind::Disparity && !(options.baseline_m > 0))
        throw Error(ErrorCode::InvalidArgument, "--depth-kind disparity needs --depth-baseline, in metres");
    if (const auto& [first, last] = settings.depthRange; first != 0 || last != 0) {
        if (!(first > 0 && last > 0) || first == last)
            throw Error(
                ErrorCode::InvalidArgument,
                "--depth-range '{:g},{:g}': must be two different depths over 0, at the value 0 and at the largest",
                first, last);
        options.range = settings.depthRange;
    }
    return options;
}

DepthSource::DepthSource(const Settings& settings, const camera::Pose& firstPose,
                         std::shared_ptr<const PicturesInMemory> inMemory)
    : settings_(settings), holds_(settings.onError == "hold")
{
    if (settings.depth.empty()) {
        groundLevel_ = firstPose.position.y - parseGround(settings.ground).height_m;
        return;
    }
    options_ = depthOptionsOf(settings);
    reader_.emplace(settings, std::move(inMemory));
}

void DepthSource::readFrame(FrameNumber frame, const DepthWindow& window, ConstImageViewF plate, bool isSamePlate)
{
    const std::string name = reader_->nameOf(frame);
    const bool needsFocal = options_.kind == depth::DepthKind::Distance || options_.kind == depth::DepthKind::Disparity;
    const bool isSameSize =
        window.frameWidth == lastWindow_.frameWidth && window.frameHeight == lastWindow_.frameHeight;
    // Edges of a smaller depth follow those of the plate, which moves even where one depth serves all frames.
    if (wholeFrame_ && name == lastName_ && isSameSize && (!followsPlate_ || isSamePlate) &&
        (!needsFocal || window.focal_px == lastWindow_.focal_px))
        return;
    const StoredDepth stored = reader_->read(frame);
    options_.full = stored.full;
    options_.skyStored = stored.sky;
    options_.focal_px = window.focal_px * stored.values.width() / window.frameWidth;
    depth::Depth depth = depth::sanitizeDepth(stored.values, options_);
    const depth::DepthCounts& counts = depth.counts;
    if (counts.filled == counts.pixels)
        throw Error(ErrorCode::Input, "depth '{}': none of its {} pixels has a depth above 0", name, counts.pixels);
    if (counts.filled > 0)
        log::detail("depth '{}': {} NaN, {} not above 0, {} without value; filled from their neighbours", name,
                    counts.nan, counts.nonPositive, counts.noValue);
    if (!isJudged_) warnOf(depthDoubts({stored.values, stored.full, depth}, settings_));
    isJudged_ = true;
    const int width = window.frameWidth, height = window.frameHeight;
    followsPlate_ = depth.metres.width() < width || depth.metres.height() < height;
    if (depth.metres.width() != width || depth.metres.height() != height) {
        if (!saidResampled_)
            log::info("depth '{}' is {}x{}; resampled to the plate's {}x{} with its edges kept", name,
                      depth.metres.width(), depth.metres.height(), width, height);
        saidResampled_ = true;
        depth = depth::resampleDepth(std::move(depth), width, height, followsPlate_ ? plate : ConstImageViewF());
    }
    wholeFrame_ = std::make_shared<const depth::Depth>(std::move(depth));
    lastName_ = name;
    last_ = nullptr;
}

std::shared_ptr<const depth::Depth> DepthSource::fromFile(FrameNumber frame, const DepthWindow& window,
                                                          ConstImageViewF plate, bool isSamePlate)
{
    readFrame(frame, window, plate, isSamePlate);
    if (last_ && window.region == lastWindow_.region) return last_;
    lastWindow_ = window;
    if (window.region == Window{0, 0, window.frameWidth, window.frameHeight}) return last_ = wholeFrame_;
    return last_ = std::make_shared<const depth::Depth>(
               depth::Depth{partOf(wholeFrame_->metres, window.region), wholeFrame_->counts, wholeFrame_->resampled});
}

std::shared_ptr<const depth::Depth> DepthSource::heldFor(FrameNumber frame, const std::string& why,
                                                         const DepthWindow& window, ConstImageViewF plate)
{
    std::vector<FrameNumber> others = reader_->frames();
    std::reverse(others.begin(), std::lower_bound(others.begin(), others.end(), frame));  // earlier ones, nearest first
    for (const FrameNumber other : others) {
        if (other == frame) continue;
        try {
            auto held = fromFile(other, window, plate, false);
            log::warning("depth held from frame {}: {}", other, why);
            return held;
        } catch (const Error&) {  // as bad as the first: try the next
        }
    }
    throw Error(ErrorCode::Input, "{}; no other frame's depth can be read", why);
}

std::shared_ptr<const depth::Depth> DepthSource::fromGround(FrameNumber frame, const camera::Pose& pose,
                                                            const DepthWindow& window)
{
    if (last_ && lastPose_ && lastPose_->position == pose.position && window == lastWindow_ &&
        lastPose_->worldFromCamera == pose.worldFromCamera)
        return last_;
    // The world's up in camera axes is the second row of worldFromCamera.
    const depth::Vector up{pose.worldFromCamera[0].y, pose.worldFromCamera[1].y, pose.worldFromCamera[2].y};
    const double height = pose.position.y - *groundLevel_;
    if (!(height > 0))
        throw Error(ErrorCode::Input, "frame {}: the camera track is {:g} m under the ground", frame, -height);
    const depth::Lens lens{window.focal_px, 0.5 * window.frameWidth - window.region.x,
                           0.5 * window.frameHeight - window.region.y};
    depth::Depth ground;
    ground.metres = depth::groundDepth(window.region.width, window.region.height, lens, height, up);
    last_ = std::make_shared<const depth::Depth>(std::move(ground));
    lastPose_ = pose;
    lastWindow_ = window;
    return last_;
}

std::shared_ptr<const depth::Depth> DepthSource::at(FrameNumber frame, const camera::Pose& pose,
                                                    const DepthWindow& window, ConstImageViewF plate, bool isSamePlate)
{
    if (groundLevel_) return fromGround(frame, pose, window);
    try {
        return fromFile(frame, window, plate, isSamePlate);
    } catch (const Error& error) {
        if (!holds_ || reader_->isOne()) throw;
        return heldFor(frame, error.what(), window, plate);
    }
}

}  // namespace virga::shot
