#include "shot/RainJob.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <nlohmann/json.hpp>
#include <set>

#include "core/Error.h"
#include "core/Log.h"
#include "core/Timeline.h"
#include "io/AtomicFile.h"
#include "io/ColorConversion.h"
#include "io/ImageFile.h"
#include "io/Writers.h"
#include "shot/CameraTrack.h"
#include "shot/ContactSheet.h"
#include "shot/Doubts.h"
#include "shot/FrameChoice.h"
#include "shot/JobInputs.h"
#include "shot/OverscanRenderer.h"
#include "shot/Parameters.h"
#include "shot/Resume.h"

namespace virga::shot {
namespace {

bool isRun(const std::vector<FrameNumber>& frames)
{
    return std::adjacent_find(frames.begin(), frames.end(), [](auto a, auto b) { return b != a + 1; }) == frames.end();
}

/// Whether the result is a run of the plate's frames in the same codec: nothing is done to any of them, and nobody asks
/// for another form.
bool isThePlate(const Settings& s, const RainJobOptions& options, const io::PlateInfo& plate,
                const std::vector<FrameNumber>& frames)
{
    const bool asksForForm = !s.codec.empty() || s.quality || !s.pixelFormat.empty() || !s.profile.empty() ||
                             !s.preset.empty() || !s.codecOptions.empty() || !s.outputColorspace.empty() || s.fps ||
                             s.reencode || plate.isDeinterlaced || options.layers || !options.preview.empty();
    return plate.isMovie && io::isMovieName(options.output) && !asksForForm && isRun(frames) &&
           planFrame(s, {}, false).isPassThrough();
}

/// For --resume.
std::vector<FrameNumber> framesLeft(const std::string& output, const std::vector<FrameNumber>& frames,
                                    const FrameFingerprints& fingerprints)
{
    if (!io::isFramePattern(output))
        throw Error(ErrorCode::InvalidArgument,
                    "--resume: the output '{}' is one file; frames that are there can be kept in a sequence alone",
                    output);
    if (!io::keepsSoftware(output))
        throw Error(
            ErrorCode::InvalidArgument,
            "--resume: files such as '{}' do not hold what they were made of; EXR, PNG, TIFF, JPEG, DPX and Targa do",
            output);
    return framesToMake(frames, output, fingerprints);
}

/// The picture alone, without layers.
CompositorOptions compositorOptionsOf(const RainJobOptions& options)
{
    CompositorOptions how;
    how.cacheFolder = options.cacheFolder;
    how.device = options.device;
    how.shaderFolder = options.shaderFolder;
    return how;
}

std::unique_ptr<FrameRenderer> rendererOf(const Settings& settings, const Shot& shot, const RainJobOptions& options,
                                          const PlateSamples& samples, Timeline* timeline)
{
    CompositorOptions how = compositorOptionsOf(options);
    how.wanted.layers = options.layers;
    how.timeline = timeline;
    if (options.reference)
        return std::make_unique<ReferenceRenderer>(settings, shot, how.wanted, samples, *options.reference);
    return std::make_unique<Compositor>(settings, shot, how, samples);
}

/// Nothing if the plate has no overscan, or the output no place for it, or nothing is done to it.
std::unique_ptr<OverscanRenderer> overscanRendererOf(const Settings& settings, const Shot& shot,
                                                     const RainJobOptions& options, const io::PlateInfo& plate,
                                                     const PlateSamples& samples)
{
    const Margins margins{plate.overscanX, plate.overscanY};
    const bool isExr = io::isImageName(options.output) && io::imageFormatOf(options.output) == "openexr";
    if (margins.isEmpty() || !isExr || planFrame(settings, {}, false).isPassThrough()) return nullptr;
    if (options.reference) {
        log::warning("{}: the reference renders inside the display window; the overscan stays as it is",
                     options.output);
        return nullptr;
    }
    return std::make_unique<OverscanRenderer>(settings, shot, margins, compositorOptionsOf(options), samples);
}

MemoryDemand demandOf(const Settings& settings, const RainJobOptions& options, const FrameRenderer& renderer,
                      const std::vector<FrameNumber>& frames, const io::PlateInfo& plate)
{
    const bool isImage = io::isImageName(options.output);
    return {.frames = frames.size(),
            .strokes = renderer.expectedStrokes(),
            .isDepthAnImage = !settings.depth.empty(),
            .writesSequence = isImage,
            .writesHalf = isImage && io::imageFormatOf(options.output) == "openexr" &&
                          (options.half || !plate.isFloat || plate.bitDepth == 16) && !settings.floatOutput,
            .byShaders = renderer.drawsByShaders()};
}

double peakMemory_mb()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return double(usage.ru_maxrss) / 1024;
}

}  // namespace

RainReport runRainJob(const Settings& settings, const RainJobOptions& options,
                      const std::function<Verdict(const Progress&)>& progress)
{
    const Timer start;
    checkPreview(options);
    checkTimeline(options);
    Timeline timelineOfJob;
    Timeline* const timeline = options.timeline.empty() ? nullptr : &timelineOfJob;
    timelineOfJob.nameThread("renderer");
    const auto begin = Timeline::Clock::now();
    const io::OnError onError = onErrorOf(settings);
    io::ReadOptions readOptions = readOptionsOf(settings, onError);
    readOptions.timeline = timeline;
    const auto reader = io::openPlate(options.plate, readOptions);
    const io::PlateInfo& plate = reader->info();
    std::vector<FrameNumber> frames = chooseFrames(options.frames, plate, onError);
    if (plate.isMovie && !std::is_sorted(frames.begin(), frames.end()))
        log::warning("frames are rendered in the order given, {}", options.frames);
    if (frames.size() > 1 && io::isImageName(options.output) && !io::isFramePattern(options.output))
        throw Error(ErrorCode::Output,
                    "{}: is one image, but there are {} frames; name a pattern such as shot.%04d.exr", options.output,
                    frames.size());
    refuseWritingOverInputs(settings, options, frames);
    std::string copyObstacle;
    if (isThePlate(settings, options, plate, frames)) {
        const Timer clock;
        Progress state;
        state.total = frames.size();
        bool goesOn = true;
        const auto [obstacle, copied] =
            io::copyMovie(options.output, *reader, frames, settings.container, [&](std::size_t count) {
                state.done = count;
                state.frame = frames[count - 1];
                state.seconds = clock.seconds();
                return goesOn = progress(state) == Verdict::Continue;
            });
        if (obstacle.empty()) {
            RainReport report;
            report.plate = plate;
            report.plan = planFrame(settings, {}, false);
            report.frames.assign(frames.begin(), frames.begin() + std::ptrdiff_t(copied));
            report.stopped = !goesOn;
            report.seconds = clock.seconds();
            report.startSeconds = start.seconds() - report.seconds;
            report.isStreamCopy = true;
            if (timeline != nullptr) io::writeWholeFile(options.timeline, timeline->json());
            return report;
        }
        log::detail("{}: the pictures are encoded anew: {}", options.output, obstacle);
        copyObstacle = obstacle;
    }
    if (options.reference && options.resume)
        throw Error(ErrorCode::InvalidArgument, "--reference and --resume exclude each other: every frame is made");
    const FrameFingerprints fingerprints(settings, plate, options.layers, options.half);
    io::WriteOptions writeOptions = writeOptionsOf(settings, options);
    // What the reference made is no frame that --resume may keep.
    if (!options.reference) writeOptions.software = [&](FrameNumber frame) { return fingerprints.of(frame); };
    writeOptions.timeline = timeline;
    const auto writer = io::createPlateWriter(options.output, *reader, writeOptions);
    reader->fitChroma(writer->sharedChroma());
    RainReport report;
    report.copyObstacle = copyObstacle;
    if (options.resume) {
        const std::size_t all = frames.size();
        frames = framesLeft(options.output, frames, fingerprints);
        report.keptFrames = all - frames.size();
        if (report.keptFrames > 0)
            log::info("'{}': {} of {} frames are there, made of the same, and stay", options.output, report.keptFrames,
                      all);
        if (frames.empty()) {
            report.plate = plate;
            report.plan = planFrame(settings, {.layers = options.layers}, false);
            return report;
        }
    }

    Shot shot{plate.width, plate.height, settings.fps.value_or(plate.fps), plate.frames.front()};
    if (!planFrame(settings, {}, false).isPassThrough()) shot.track = shotTrack(settings, plate);
    const bool isLit = planFrame(settings, {.layers = options.layers}, false).features.light();
    PlateSamples samples = samplePlate(*reader, settings, isLit, shot.track.isStatic());
    const std::unique_ptr<FrameRenderer> renderer = rendererOf(settings, shot, options, samples, timeline);
    const std::unique_ptr<OverscanRenderer> overscan = overscanRendererOf(settings, shot, options, plate, samples);
    samples = {};  // whole frames
    if (!shot.track.empty()) warnOf(trackDoubts(shot.track, frames, shot.fps, settings));
    checkDepthFrames(settings, renderer->plan(), frames, onError);

    report.plate = plate;
    report.plan = renderer->plan();
    const std::vector<MemoryUse> memory =
        planMemory(report.plan, plate, demandOf(settings, options, *renderer, frames, plate));
    report.plannedBytes = totalBytes(memory);
    if (options.onPlan) options.onPlan(memory);
    report.startSeconds = start.seconds();

    ContactSheet sheet(options.preview, frames);
    // A preview shows the light of both.
    const bool isUntouched = renderer->plan().isPassThrough() && options.preview.empty();
    const bool goesByRows =
        renderer->takesRows() && options.preview.empty() && !overscan && writer->canvas() != nullptr;
    reader->schedule(frames, isUntouched && writer->takesCodes() ? io::Pixels::Codes
                             : goesByRows                        ? io::Pixels::Rows
                                                                 : io::Pixels::Light);
    if (timeline != nullptr) timeline->add("renderer", "start", frames.front(), begin, Timeline::Clock::now());
    const Timer clock;
    Progress state;
    state.total = frames.size();
    // What the device is not done with, oldest first.
    std::deque<io::RenderedFrame> inFlight;
    const auto deliver = [&] {
        io::RenderedFrame rendered = std::move(inFlight.front());
        inFlight.pop_front();
        const FrameNumber number = rendered.number;
        if (goesByRows && renderer->framesInFlight() > 0) renderer->complete();
        sheet.addAfter(number, rendered.beauty);
        const StageSpan span(timeline, "renderer", "hand over", number);
        writer->write(std::move(rendered));
        report.frames.push_back(number);
        state.done = report.frames.size();
        state.frame = number;
        state.seconds = clock.seconds();
    };
    const std::size_t mostInFlight = goesByRows ? renderer->framesInFlight() : 0;
    for (const FrameNumber number : frames) {
        std::optional<io::PlateFrame> frame = [&] {
            const StageSpan span(timeline, "renderer", "wait for plate", number);
            return reader->read(plate.isStill ? plate.frames.front() : number);
        }();
        if (!frame) {
            report.repairedFrames.push_back(fmt::format("frame {} was skipped", number));
            continue;
        }
        frame->number = number;
        if (!frame->repaired.empty()) report.repairedFrames.push_back(frame->repaired);
        sheet.addBefore(number, frame->pixels);
        try {
            const StageSpan span(timeline, "renderer", "render", number);
            if (overscan) overscan->begin(*frame);
            io::RenderedFrame rendered = renderer->render(std::move(*frame), goesByRows ? writer->canvas() : nullptr);
            if (overscan) rendered.around = overscan->finish();
            inFlight.push_back(std::move(rendered));
        } catch (const Error& error) {  // its depth
            if (onError != io::OnError::Skip || error.code() != ErrorCode::Input) throw;
            report.repairedFrames.push_back(fmt::format("frame {} was skipped: {}", number, error.what()));
            log::warning("{}", report.repairedFrames.back());
            continue;
        }
        if (inFlight.size() <= mostInFlight) continue;
        deliver();
        if (progress(state) == Verdict::Stop) {
            report.stopped = true;
            break;
        }
    }
    while (!inFlight.empty()) {
        deliver();
        if (!report.stopped && progress(state) == Verdict::Stop) report.stopped = true;
    }
    if (report.frames.empty())
        throw Error(ErrorCode::Input, "plate '{}': none of the frames {} could be read", plate.path,
                    formatFrameRange(frames));
    writer->finish();
    report.seconds = clock.seconds();
    report.statistics = renderer->statistics();
    sheet.write(plate);
    if (timeline != nullptr) io::writeWholeFile(options.timeline, timeline->json());
    return report;
}

std::string explain(const FramePlan& plan, const CompositorStatistics* statistics)
{
    const auto cost = [&](const std::string& pass) -> std::string {
        if (statistics == nullptr || statistics->frames == 0) return "";
        const auto found = statistics->passMs.find(pass);
        if (found == statistics->passMs.end()) return "";
        return fmt::format("{:.2f} ms", found->second / double(statistics->frames));
    };
    std::string text;
    for (const PlannedPass& pass : plan.passes)
        text += fmt::format("{:<17} {:<8} {:<10} {}\n", pass.name, pass.runs ? "on" : "skipped",
                            pass.runs ? cost(pass.name) : "", pass.why);
    if (statistics != nullptr && statistics->frames > 0)
        for (const char* step :
             {"cells", "inputs", "drops", "conversion", "upload", "to light", "to codes", "read-back"})
            if (const std::string ms = cost(step); !ms.empty())
                text += fmt::format("{:<17} {:<8} {}\n", step, "on", ms);
    return text;
}

std::string reportJson(const RainReport& report, const Settings& settings)
{
    using nlohmann::json;
    const CompositorStatistics& s = report.statistics;
    const double frames = double(std::max<std::size_t>(report.frames.size(), 1));
    json passes = json::object(), skipped = json::object();
    for (const auto& [name, ms] : s.passMs) passes[name] = ms / frames;
    for (const PlannedPass& pass : report.plan.passes)
        if (!pass.runs) skipped[pass.name] = pass.why;

    json settingsJson = json::object();
    for (const Parameter& p : parameters()) settingsJson[p.name] = toJson(settings, p);
    json object = {
        {"frames", report.frames.size()},
        {"frame_range", formatFrameRange(report.frames)},
        {"width", report.plate.width},
        {"height", report.plate.height},
        {"fps", report.plate.fps},
        {"fps_rendered", report.seconds > 0 ? double(report.frames.size()) / report.seconds : 0},
        {"seconds", report.seconds},
        {"start_seconds", report.startSeconds},
        {"render_ms_per_frame", 1e3 * s.renderSeconds / frames},
        {"strokes_per_frame", double(s.strokes) / frames},
        {"splashes_per_frame", double(s.splashes) / frames},
        {"passes", passes},
        {"skipped", skipped},
        {"left_out",
         {{"cells_behind_depth_per_frame", double(s.hiddenCells) / frames},
          {"lamps_per_frame", double(s.lampsLeftOut) / frames},
          {"unchanged_plates", s.samePlates}}},
        {"device", s.device},
        {"peak_memory_mb", peakMemory_mb()},
        {"planned_memory_mb", report.plannedBytes / 1048576},
        {"renderer_memory_mb", double(s.rendererBytes) / 1048576},
        {"plate",
         {{"path", report.plate.path},
          {"format", report.plate.format},
          {"scan", report.plate.isMovie ? json(io::scanWords(report.plate.scan)) : json()},
          {"deinterlaced", report.plate.isDeinterlaced},
          {"colorspace", report.plate.colorspace},
          {"colorspace_source", report.plate.colorspaceSource},
          {"working_colorspace", report.plate.workingColorspace},
          {"ocio", report.plate.colors ? report.plate.colors->origin() : ""}}},
        {"light",
         {{"source", s.lightSource},
          {"order", s.lightOrder},
          {"remainder", s.lightRemainder},
          {"lights", s.lightCount}}},
        {"fog_extinction_per_m", s.fogExtinction_1_m},
        {"repaired",
         {{"plate_values", s.repairedPixels},
          {"depth_pixels", s.depthCounts.filled},
          {"depth_nan", s.depthCounts.nan},
          {"depth_non_positive", s.depthCounts.nonPositive},
          {"depth_no_value", s.depthCounts.noValue},
          {"depth_infinite", s.depthCounts.infinite},
          {"depth_resampled", s.depthResampled},
          {"frames", report.repairedFrames}}},
        {"stopped", report.stopped},
        {"stream_copied", report.isStreamCopy},
        {"not_copied_because", report.copyObstacle.empty() ? json() : json(report.copyObstacle)},
        {"kept_frames", report.keptFrames},
        {"settings", settingsJson},
    };
    // A file name need not be UTF-8; JSON must.
    return object.dump(2, ' ', false, json::error_handler_t::replace);
}

}  // namespace virga::shot
