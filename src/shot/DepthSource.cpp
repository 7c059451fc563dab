#include "shot/DepthSource.h"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "core/Error.h"
#include "core/Log.h"
#include "depth/Geometry.h"
#include "io/Plate.h"

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

DepthSource::DepthSource(const Settings& settings, int width, int height, const camera::Pose& firstPose)
    : pattern_(settings.depth), width_(width), height_(height), holds_(settings.onError == "hold")
{
    options_.scale = settings.depthScale;
    options_.invert = settings.depthInvert;
    options_.noValue = settings.depthNoValue;
    if (pattern_.empty()) {
        groundLevel_ = firstPose.position.y - parseGround(settings.ground).height_m;
    } else if (io::isFramePattern(pattern_)) {
        if (io::findFrames(pattern_).empty())
            throw Error(ErrorCode::Input, "depth '{}': no frame of that pattern exists", pattern_);
    } else if (!std::filesystem::exists(pattern_)) {
        throw Error(ErrorCode::Input, "depth '{}': no such file", pattern_);
    }
}

std::shared_ptr<const depth::Depth> DepthSource::fromImage(const std::string& path, ConstImageViewF plate)
{
    const io::RawImage raw = io::readRawImage(path);
    const auto& names = raw.channelNames;
    // A layer of depth is called Z, depth.Z or the like; else the first channel is taken.
    const auto z = std::find_if(names.begin(), names.end(), [](const std::string& name) {
        return name == "Z" || name == "z" || name.ends_with(".Z") || name.ends_with(".z");
    });
    const int channel = z != names.end() ? int(z - names.begin()) : 0;
    if (!saidKind_ && raw.isDisplayReferred && raw.bitDepth == 8)
        log::warning("depth '{}' has 8 bits a pixel: {} levels of depth", path, 256);
    if (!saidKind_ && z == names.end() && names.size() > 1)
        log::warning("depth '{}' has no channel Z; its '{}' is taken", path, names[0]);
    saidKind_ = true;
    ImageF stored(raw.pixels.width(), raw.pixels.height(), 1);
    for (int y = 0; y < stored.height(); ++y)
        for (int x = 0; x < stored.width(); ++x) stored.at(x, y) = raw.pixels.at(x, y, channel);

    depth::Depth depth = depth::sanitizeDepth(stored, options_);
    const depth::DepthCounts& counts = depth.counts;
    if (counts.filled == counts.pixels)
        throw Error(ErrorCode::Input, "depth '{}': none of its {} pixels has a depth above 0", path, counts.pixels);
    if (counts.filled > 0)
        log::detail("depth '{}': {} NaN, {} not above 0, {} without value; filled from their neighbours", path,
                    counts.nan, counts.nonPositive, counts.noValue);
    followsPlate_ = depth.metres.width() < width_ || depth.metres.height() < height_;
    if (depth.metres.width() != width_ || depth.metres.height() != height_) {
        if (!saidResampled_)
            log::info("depth '{}' is {}x{}; resampled to the plate's {}x{} with its edges kept", path,
                      depth.metres.width(), depth.metres.height(), width_, height_);
        saidResampled_ = true;
        depth = depth::resampleDepth(std::move(depth), width_, height_, followsPlate_ ? plate : ConstImageViewF());
    }
    return std::make_shared<const depth::Depth>(std::move(depth));
}

std::shared_ptr<const depth::Depth> DepthSource::fromFile(FrameNumber frame, const std::string& path,
                                                          ConstImageViewF plate)
{
    // Edges of a smaller depth follow those of the plate, which moves even where one depth serves all frames.
    if (path == lastPath_ && !followsPlate_) return last_;
    if (!std::filesystem::exists(path))
        throw Error(ErrorCode::Input, "frame {}: its depth '{}' does not exist", frame, path);
    last_ = fromImage(path, plate);
    lastPath_ = path;
    return last_;
}

std::shared_ptr<const depth::Depth> DepthSource::heldFor(FrameNumber frame, const std::string& why,
                                                         ConstImageViewF plate)
{
    std::vector<FrameNumber> others = io::findFrames(pattern_);
    std::reverse(others.begin(), std::lower_bound(others.begin(), others.end(), frame));  // earlier ones, nearest first
    for (const FrameNumber other : others) {
        if (other == frame) continue;
        try {
            auto held = fromFile(other, io::framePath(pattern_, other), plate);
            log::warning("depth held from frame {}: {}", other, why);
            return held;
        } catch (const Error&) {  // as bad as the first: try the next
        }
    }
    throw Error(ErrorCode::Input, "{}; no other frame of '{}' can be read", why, pattern_);
}

std::shared_ptr<const depth::Depth> DepthSource::at(FrameNumber frame, const camera::Pose& pose,
                                                    const camera::Projection& projection, ConstImageViewF plate)
{
    if (groundLevel_) {
        if (last_ && lastPose_ && lastPose_->position == pose.position &&
            lastPose_->worldFromCamera == pose.worldFromCamera && lastPose_->verticalFov == pose.verticalFov)
            return last_;
        // The world's up in camera axes is the second row of worldFromCamera.
        const depth::Vector up{pose.worldFromCamera[0].y, pose.worldFromCamera[1].y, pose.worldFromCamera[2].y};
        const double height = pose.position.y - *groundLevel_;
        if (!(height > 0))
            throw Error(ErrorCode::Input, "frame {}: the camera track is {:g} m under the ground", frame, -height);
        depth::Depth ground;
        ground.metres =
            depth::groundDepth(width_, height_, 2 * std::atan(0.5 * width_ / projection.focal_px), height, up);
        last_ = std::make_shared<const depth::Depth>(std::move(ground));
        lastPose_ = pose;
        return last_;
    }
    const std::string path = io::isFramePattern(pattern_) ? io::framePath(pattern_, frame) : pattern_;
    try {
        return fromFile(frame, path, plate);
    } catch (const Error& error) {
        if (!holds_ || !io::isFramePattern(pattern_)) throw;
        return heldFor(frame, error.what(), plate);
    }
}

}  // namespace virga::shot
