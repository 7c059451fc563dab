#include "FrameRequest.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "Pixels.h"
#include "core/Error.h"

namespace virga::lib {
namespace {

/// The frame that it lies in, and how much later than its beginning, 0 to under 1.
std::pair<FrameNumber, double> checkedFrame(double frame)
{
    constexpr double farthest = 9e15;  // beyond, doubles leave whole numbers out
    if (!(std::abs(frame) <= farthest))
        throw Error(ErrorCode::InvalidArgument, "frame {}: must be a number within {:g}", frame, farthest);
    const double whole = std::floor(frame), later = frame - whole;
    if (later >= 1) return {FrameNumber(whole) + 1, 0};  // so little before it that it rounds to it
    return {FrameNumber(whole), later};
}

Window checkedRegion(const virga_window& given, const Window& frame)
{
    if (given.width == 0 && given.height == 0) return frame;
    constexpr int farthest = 2 * mostPixels;
    const bool isNear = std::abs(double(given.x)) <= farthest && std::abs(double(given.y)) <= farthest;
    if (given.width < 1 || given.height < 1 || given.width > mostPixels || given.height > mostPixels || !isNear)
        throw Error(ErrorCode::InvalidArgument,
                    "region of {} x {} at ({}, {}): each side must be 1 to {} pixels, within {} of the frame",
                    given.width, given.height, given.x, given.y, mostPixels, farthest);
    return {given.x, given.y, given.width, given.height};
}

}  // namespace

FrameRequest::FrameRequest(const virga_request* given, int width, int height, bool needsPictures)
{
    const virga_request r = known(given);
    std::tie(number, later) = checkedFrame(r.frame);
    scale = checkedScale(r.scale);
    frame = shot::frameAt(width, height, scale);
    region = checkedRegion(r.region, frame);
    progress = r.progress;
    user = r.user;
    priority = r.priority;
    plateContent = r.plate_content;
    if (r.depth != nullptr) depth.emplace(Picture::ofItsOwnSize(r.depth, "depth"));
    if (!needsPictures) return;

    plate.emplace(r.plate, "plate", frame);
    const std::pair<const char*, const virga_picture*> wanted[] = {
        {"", r.beauty}, {"rain", r.rain}, {"splash", r.splash}, {"fog", r.fog}, {"plate", r.graded_plate}};
    for (const auto& [layer, picture] : wanted) {
        if (picture == nullptr) continue;
        const char* name = picture == r.beauty ? "beauty" : picture == r.graded_plate ? "graded_plate" : layer;
        outputs.push_back({layer, Picture(picture, name, region)});
        const Picture& output = outputs.back().picture;
        const Window& window = output.window();
        if (!window.contains(region))
            throw Error(ErrorCode::InvalidArgument,
                        "{}: its window of {} x {} at ({}, {}) does not hold the region of {} x {} at ({}, {})", name,
                        window.width, window.height, window.x, window.y, region.width, region.height, region.x,
                        region.y);
        if (wholeChroma(output, region) != region)
            throw Error(ErrorCode::InvalidArgument,
                        "{}: pixels share chroma, which the region of {} x {} at ({}, {}) would cut", name,
                        region.width, region.height, region.x, region.y);
    }
    if (outputs.empty()) throw Error(ErrorCode::InvalidArgument, "request: asks for no picture");
}

bool FrameRequest::wantsLayers() const
{
    return std::any_of(outputs.begin(), outputs.end(), [](const Output& output) { return *output.layer != '\0'; });
}

const Picture* FrameRequest::beauty() const
{
    return !outputs.empty() && *outputs.front().layer == '\0' ? &outputs.front().picture : nullptr;
}

shot::View FrameRequest::view(const Window& given) const
{
    return {scale, region == frame ? Window{} : region, given == frame && frame.contains(region) ? Window{} : given,
            later};
}

}  // namespace virga::lib
