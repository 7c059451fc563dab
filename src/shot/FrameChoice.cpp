#include "shot/FrameChoice.h"

#include <algorithm>

#include "core/Error.h"
#include "core/Log.h"

namespace virga::shot {
namespace {

constexpr FrameNumber mostMissing = 1'000'000;

/// All between the first and the last frame of a sequence.
std::vector<FrameNumber> wholeRange(const io::PlateInfo& plate)
{
    const FrameNumber first = plate.frames.front(), last = plate.frames.back();
    if (plate.isStill || plate.isMovie || last - first == FrameNumber(plate.frames.size()) - 1) return plate.frames;
    if (last - first - FrameNumber(plate.frames.size()) > mostMissing)
        throw Error(ErrorCode::Input,
                    "'{}': most of the frames between {} and {} are missing; name those that are wanted with --frames",
                    plate.path, first, last);
    std::vector<FrameNumber> all;
    for (FrameNumber frame = first; frame <= last; ++frame) all.push_back(frame);
    return all;
}

}  // namespace

std::string describeFrames(const std::vector<FrameNumber>& frames, const char* one, const char* several)
{
    const bool isOne = frames.size() == 1;
    return fmt::format("frame{} {} {}", isOne ? "" : "s", formatFrameRange(frames), isOne ? one : several);
}

std::vector<FrameNumber> chooseFrames(const std::string& range, const io::PlateInfo& plate, io::OnError onError)
{
    if (plate.frames.empty()) throw Error(ErrorCode::Input, "plate '{}' holds no frame", plate.path);
    std::vector<FrameNumber> frames = range.empty() ? wholeRange(plate) : parseFrameRange(range);
    if (plate.isStill) return frames;
    std::vector<FrameNumber> missing;
    for (const FrameNumber frame : frames)
        if (!std::binary_search(plate.frames.begin(), plate.frames.end(), frame)) missing.push_back(frame);
    if (missing.empty()) return frames;
    const std::string there = fmt::format("'{}', which has {}", plate.path, formatFrameRange(plate.frames));
    if (plate.isMovie)
        throw Error(ErrorCode::InvalidArgument, "{} not in the plate {}", describeFrames(missing, "is", "are"), there);
    if (onError == io::OnError::Stop)
        throw Error(ErrorCode::Input, "{} missing from {}; --on-error skip or hold goes on",
                    describeFrames(missing, "is", "are"), there);
    return frames;
}

}  // namespace virga::shot
