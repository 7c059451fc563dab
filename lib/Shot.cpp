#include "Shot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <utility>

#include "Pixels.h"
#include "core/Error.h"
#include "core/KeptFiles.h"
#include "gl/Context.h"
#include "shot/FramePlan.h"

namespace virga::lib {

Shot::Shot(int width, int height, double fps) : width_(width), height_(height), fps_(fps)
{
    if (width < 1 || height < 1 || width > mostPixels || height > mostPixels)
        throw Error(ErrorCode::InvalidArgument, "a picture of {} x {}: each side must be 1 to {} pixels", width, height,
                    mostPixels);
    if (!(fps > 0) || std::isinf(fps))
        throw Error(ErrorCode::InvalidArgument, "{} frames a second: must be over 0", fps);
}

Shot::~Shot()
{
    if (compositor_) queue_->run([this] { compositor_ = nullptr; });
}

// ---- Settings -------------------------------------------------------------------------------------------------------

void Shot::change(const std::function<void(shot::Settings&)>& set)
{
    const std::lock_guard turn(turn_);
    shot::Settings changed = settings_;
    set(changed);
    settings_ = std::move(changed);
    ++settingsCount_;
}

shot::Settings Shot::settings() const
{
    const std::lock_guard turn(turn_);
    return settings_;
}

void Shot::setDevice(const std::string& device)
{
    if (!gl::isDeviceName(device))
        throw Error(ErrorCode::InvalidArgument, "device '{}': must be auto, cpu, gpu or a device number", device);
    const std::lock_guard turn(turn_);
    device_ = device;
    fallback_.clear();
}

std::string Shot::device() const
{
    const std::lock_guard turn(turn_);
    if (!compositor_) return "";
    const std::string& drawing = compositor_->statistics().device;
    return fallback_.empty() ? drawing : fmt::format("{}, in place of device '{}': {}", drawing, device_, fallback_);
}

const char* Shot::keep(Text kind, std::string text)
{
    const std::lock_guard turn(turn_);
    return (texts_[kind] = std::move(text)).c_str();
}

void Shot::addSample(FrameNumber frame, const virga_picture* given)
{
    const Picture plate(given, "plate sample", Window{0, 0, width_, height_});
    const std::lock_guard turn(turn_);
    const Window whole = shot::frameAt(width_, height_, 1);
    if (!plate.window().contains(whole))
        throw Error(ErrorCode::InvalidArgument,
                    "plate sample of frame {}: {} x {} at ({}, {}); must be the whole {} x {}", frame,
                    plate.window().width, plate.window().height, plate.window().x, plate.window().y, width_, height_);
    colors_.use(settings_.ocio);
    ImageF pixels = readPixels(plate, whole, *colors_.toLinear(plate.colorspace(), plate.name()), nullptr);
    Sample& sample = samples_[frame];
    sample.forLight = shot::averagedForLight(ImageRows(pixels));
    sample.whole = settings_.gradeFrom.empty() ? ImageF() : std::move(pixels);
    ++samplesCount_;
}

void Shot::clearSamples()
{
    const std::lock_guard turn(turn_);
    samples_.clear();
    ++samplesCount_;
}

std::vector<FrameNumber> Shot::samplesWanted(FrameNumber first, FrameNumber last) const
{
    constexpr FrameNumber most = FrameNumber(1) << 52;
    if (first > last || first < -most || last > most)
        throw Error(ErrorCode::InvalidArgument, "frames {} to {}: must be in order, within {}", first, last, most);
    const std::lock_guard turn(turn_);
    const auto count = std::size_t(last - first + 1);
    std::set<std::size_t> places = shot::placesForGrade(count, settings_);
    if (shot::planFrame(settings_, {}, false).features.light()) places.merge(shot::placesForLight(count, settings_));
    std::vector<FrameNumber> frames;
    for (const std::size_t place : places) frames.push_back(first + FrameNumber(place));
    return frames;
}

/// Those at `places` of a plate from the first to the last of them, if all are there; else what there is.
std::vector<FrameNumber> Shot::chosenSamples(const std::set<std::size_t>& places, FrameNumber first) const
{
    std::vector<FrameNumber> frames;
    for (const std::size_t place : places) frames.push_back(first + FrameNumber(place));
    const auto isThere = [&](FrameNumber frame) { return samples_.contains(frame); };
    if (std::all_of(frames.begin(), frames.end(), isThere)) return frames;
    frames.clear();
    for (const auto& [frame, sample] : samples_) frames.push_back(frame);
    return frames;
}

void Shot::chooseSamples(Made& made) const
{
    if (samples_.empty()) return;
    const shot::Settings settings = settingsFor(made);
    const FrameNumber first = samples_.begin()->first, last = samples_.rbegin()->first;
    const auto count = std::size_t(last - first + 1);
    made.lit = chosenSamples(shot::placesForLight(count, settings), first);
    made.graded = chosenSamples(shot::placesForGrade(count, settings), first);
    std::erase_if(made.graded, [&](FrameNumber frame) { return samples_.at(frame).whole.empty(); });
}

shot::PlateSamples Shot::plateSamples(const Made& made) const
{
    shot::PlateSamples samples;
    for (const FrameNumber frame : made.lit) samples.forLight.push_back({frame, samples_.at(frame).forLight});
    for (const FrameNumber frame : made.graded) samples.forGrade.push_back(samples_.at(frame).whole);
    return samples;
}

void Shot::setEnvironment(const virga_picture* given)
{
    if (given == nullptr) {
        const std::lock_guard turn(turn_);
        panorama_.clear();
        inMemory_->panorama = {};
        return;
    }
    const Picture picture = Picture::ofItsOwnSize(given, "environment");
    const std::lock_guard turn(turn_);
    colors_.use(settings_.ocio);
    ImageF pixels =
        readPixels(picture, picture.window(), *colors_.toLinear(picture.colorspace(), picture.name()), nullptr);
    const std::string_view bytes(reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(float));
    panorama_ = fmt::format("{}{}x{} {:016x}{}", shot::PicturesInMemory::panoramaName, pixels.width(), pixels.height(),
                            contentHash(bytes), picture.isInteger() ? " to white" : "");
    inMemory_->panorama = std::move(pixels);
    inMemory_->endsAtWhite = picture.isInteger();
}

shot::Settings Shot::settingsFor(const Made& made) const
{
    shot::Settings settings = settings_;
    if (made.hasDepth) settings.depth = shot::PicturesInMemory::depthName;
    if (!made.panorama.empty()) settings.env = made.panorama;
    return settings;
}

bool Shot::isIdentity() const
{
    const std::lock_guard turn(turn_);
    return shot::planFrame(settings_, {}, false).isPassThrough();
}

Window Shot::frameAt(double scale) const { return shot::frameAt(width_, height_, checkedScale(scale)); }

}  // namespace virga::lib
