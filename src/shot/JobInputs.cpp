#include "shot/JobInputs.h"

#include <cmath>
#include <set>

#include "core/Error.h"
#include "io/AtomicFile.h"
#include "shot/FrameChoice.h"

namespace virga::shot {
namespace {

/// Throws Error(InvalidArgument) unless the number is whole.
template <class Integer>
std::optional<Integer> wholeOf(const char* flag, AutoNumber value)
{
    if (!value) return std::nullopt;
    if (*value != std::round(*value))
        throw Error(ErrorCode::InvalidArgument, "--{} '{}': must be a whole number", flag, *value);
    return Integer(*value);
}

/// Nothing: as the plate is.
std::optional<bool> halfOf(const Settings& settings, const RainJobOptions& options)
{
    if (settings.floatOutput) return false;
    if (options.half) return true;
    return std::nullopt;
}

}  // namespace

io::OnError onErrorOf(const Settings& settings)
{
    if (settings.onError == "skip") return io::OnError::Skip;
    if (settings.onError == "hold") return io::OnError::Hold;
    return io::OnError::Stop;
}

io::ReadOptions readOptionsOf(const Settings& settings, io::OnError onError)
{
    io::ReadOptions options;
    options.colorspace = settings.colorspace;
    options.ocio = settings.ocio;
    options.fps = settings.fps;
    options.firstFrame = wholeOf<FrameNumber>("first-frame", settings.firstFrame);
    options.onError = onError;
    options.stream = wholeOf<int>("stream", settings.stream);
    options.layer = settings.layer;
    options.view = settings.view;
    options.deinterlace = settings.deinterlace;
    return options;
}

io::WriteOptions writeOptionsOf(const Settings& settings, const RainJobOptions& options)
{
    return {.outputColorspace = settings.outputColorspace,
            .codec = settings.codec,
            .quality = settings.quality,
            .half = halfOf(settings, options),
            .layers = options.layers,
            .movie = {.container = settings.container,
                      .pixelFormat = settings.pixelFormat,
                      .profile = settings.profile,
                      .preset = settings.preset,
                      .codecOptions = settings.codecOptions}};
}

void checkDepthFrames(const Settings& s, const FramePlan& plan, const std::vector<FrameNumber>& frames,
                      io::OnError onError)
{
    if (!plan.features.depth || !io::isFramePattern(s.depth)) return;
    const std::vector<FrameNumber> found = io::findFrames(s.depth);
    const std::set<FrameNumber> known(found.begin(), found.end());
    std::vector<FrameNumber> missing;
    for (const FrameNumber frame : frames)
        if (!known.contains(frame)) missing.push_back(frame);
    if (!missing.empty() && onError == io::OnError::Stop)
        throw Error(ErrorCode::Input, "depth '{}': {} missing; there are {}", s.depth,
                    describeFrames(missing, "is", "are"), formatFrameRange(found));
}

void refuseWritingOverInputs(const Settings& s, const RainJobOptions& options, const std::vector<FrameNumber>& frames)
{
    const auto nameOf = [](const std::string& pattern, FrameNumber frame) {
        return io::isFramePattern(pattern) ? io::framePath(pattern, frame) : pattern;
    };
    const std::pair<const char*, const std::string*> inputs[] = {{"depth", &s.depth},   {"env", &s.env},
                                                                 {"lights", &s.lights}, {"mattes", &s.mattes},
                                                                 {"camera", &s.camera}, {"grade-from", &s.gradeFrom}};
    for (const auto& [flag, input] : inputs) {
        if (input->empty()) continue;
        for (const std::string& output : {options.output, options.preview, options.timeline})
            for (const FrameNumber frame : frames) {
                const std::string written = nameOf(output, frame);
                if (io::isSameFile(written, nameOf(*input, frame)))
                    throw Error(ErrorCode::Output, "{}: is a file of --{}; give the result another name", written,
                                flag);
                if (!io::isFramePattern(output) && !io::isFramePattern(*input)) break;
            }
    }
}

void checkPreview(const RainJobOptions& options)
{
    if (options.preview.empty()) return;
    io::checkOutputFolder(options.preview);
    if (!options.preview.ends_with(".png") && !options.preview.ends_with(".PNG"))
        throw Error(ErrorCode::Output, "--preview '{}': must be a .png", options.preview);
    if (io::isSameFile(options.preview, options.plate))
        throw Error(ErrorCode::Output, "--preview '{}': is the plate itself", options.preview);
    if (options.preview == options.output)
        throw Error(ErrorCode::Output, "--preview '{}': is the output itself", options.preview);
}

void checkTimeline(const RainJobOptions& options)
{
    if (options.timeline.empty()) return;
    io::checkOutputFolder(options.timeline);
    if (io::isSameFile(options.timeline, options.plate))
        throw Error(ErrorCode::Output, "--timeline '{}': is the plate itself", options.timeline);
    for (const std::string& other : {options.output, options.preview})
        if (options.timeline == other)
            throw Error(ErrorCode::Output, "--timeline '{}': is another output's name", options.timeline);
}

}  // namespace virga::shot
