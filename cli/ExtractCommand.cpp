#include <fmt/format.h>
#include <malloc.h>

#include <charconv>
#include <cstdio>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "Command.h"
#include "Interrupt.h"
#include "ProgressBar.h"
#include "core/Error.h"
#include "core/Log.h"
#include "shot/ExtractJob.h"

namespace virga::cli {
namespace {

struct ExtractArguments {
    CommonFlags common;
    shot::ExtractJobOptions job;
    std::optional<int> stack;
    std::string color = "auto", slant = "auto", tile = "16x64";
};

const char* const examples = R"(Examples:
  virga extract rain.mp4 -o rain/
  virga extract shot.%04d.exr -o rain/ --frames 1001-1100 --clean derained.%04d.exr
  virga extract handheld.mov -o rain/ --stabilize --clean derained.mov
  virga extract frames.png -o rain/ --stack 20 --linear
  virga rain street.mp4 -o wet.mp4 --mattes rain/atlas.exr
  virga rain street.mp4 -o wet.mp4 --match rain/report.json
docs/extract.md says what each file holds, how it is found, and how well)";

void require(bool holds, const char* flag, double value, const char* allowed)
{
    if (!holds) throw Error(ErrorCode::InvalidArgument, "{} '{:g}': must be {}", flag, value, allowed);
}

double numberFrom(const char* flag, const std::string& text, const std::string& word, const char* allowed)
{
    double value = 0;
    const char* last = word.data() + word.size();
    if (const auto [end, error] = std::from_chars(word.data(), last, value); error != std::errc() || end != last)
        throw Error(ErrorCode::InvalidArgument, "{} '{}': must be {}", flag, text, allowed);
    return value;
}

/// Whole frames are allocated and freed all the time. Memory that is kept need not be cleared by the system again:
/// a seventh of the time of 1080p. One arena, or what one thread has freed is lost to the others.
void keepFreedMemory()
{
#ifdef __GLIBC__
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
    mallopt(M_ARENA_MAX, 1);
#endif
}

std::optional<std::array<double, 3>> colorFrom(const std::string& text)
{
    if (text == "auto") return std::nullopt;
    constexpr const char* allowed = "auto or three numbers r,g,b, each 0 to 1e+06";
    std::array<double, 3> color{};
    std::size_t at = 0;
    for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t comma = text.find(',', at);
        if ((comma == std::string::npos) != (j == 2))
            throw Error(ErrorCode::InvalidArgument, "--rain-color '{}': must be {}", text, allowed);
        color[j] = numberFrom("--rain-color", text, text.substr(at, comma - at), allowed);
        if (!(color[j] >= 0 && color[j] <= 1e6))
            throw Error(ErrorCode::InvalidArgument, "--rain-color '{}': must be {}", text, allowed);
        at = comma + 1;
    }
    return color;
}

std::optional<double> slantFrom(const std::string& text)
{
    if (text == "auto") return std::nullopt;
    constexpr const char* allowed = "auto or -90 to 90 deg";
    const double slant = numberFrom("--slant", text, text, allowed);
    if (!(slant >= -90 && slant <= 90))
        throw Error(ErrorCode::InvalidArgument, "--slant '{}': must be {}", text, allowed);
    return slant;
}

void tileFrom(const std::string& text, shot::ExtractJobOptions& job)
{
    if (text == "auto") {
        job.tileWidth = job.tileHeight = 0;
        return;
    }
    char rest = 0;
    if (std::sscanf(text.c_str(), "%dx%d%c", &job.tileWidth, &job.tileHeight, &rest) != 2 || job.tileWidth < 4 ||
        job.tileWidth > 256 || job.tileHeight < 16 || job.tileHeight > 1024)
        throw Error(ErrorCode::InvalidArgument, "--tile '{}': must be auto or WIDTHxHEIGHT, 4x16 to 256x1024", text);
}

int extract(const ExtractArguments& arguments)
{
    shot::ExtractJobOptions job = arguments.job;
    job.color = colorFrom(arguments.color);
    job.slant_deg = slantFrom(arguments.slant);
    tileFrom(arguments.tile, job);
    if (job.space != "auto" && job.space != "linear" && job.space != "display")
        throw Error(ErrorCode::InvalidArgument, "--space '{}': must be auto, linear or display", job.space);
    if (job.onError != "stop" && job.onError != "skip" && job.onError != "hold")
        throw Error(ErrorCode::InvalidArgument, "--on-error '{}': must be stop, skip or hold", job.onError);
    if (arguments.stack) {
        require(*arguments.stack >= 1 && *arguments.stack <= 10000, "--stack", *arguments.stack, "1 to 10000 frames");
        job.stack = *arguments.stack;
    }
    require(job.window >= 4 && job.window <= 1000, "--window", job.window, "4 to 1000 frames");
    require(job.strokes >= 1 && job.strokes <= 4096, "--strokes", job.strokes, "1 to 4096");
    require(job.tolerance >= 1e-9 && job.tolerance <= 0.1, "--tolerance", job.tolerance, "1e-09 to 0.1");
    require(job.fov_deg > 0 && job.fov_deg <= 170, "--fov", job.fov_deg, "over 0 and at most 170 deg");
    if (job.lambda) require(*job.lambda >= 0 && *job.lambda <= 1e12, "--lambda", *job.lambda, "0 to 1e+12");
    if (job.mu) require(*job.mu >= 0 && *job.mu <= 1e12, "--mu", *job.mu, "0 to 1e+12");
    if (job.iterations)
        require(*job.iterations >= 1 && *job.iterations <= 1000, "--iterations", *job.iterations, "1 to 1000");
    if (job.exposure_s)
        require(*job.exposure_s > 0 && *job.exposure_s <= 60, "--exposure", *job.exposure_s, "over 0 and at most 60 s");
    if (job.half && job.floats) throw Error(ErrorCode::InvalidArgument, "--half and --float exclude each other");
    if (job.linear && !job.colorspace.empty())
        throw Error(ErrorCode::InvalidArgument, "--linear and --colorspace exclude each other");
    if (job.linear) job.colorspace = "Linear Rec.709";
    if (job.paper && job.stabilize)
        throw Error(ErrorCode::InvalidArgument, "--paper and --stabilize exclude each other");

    noteInterrupts();
    keepFreedMemory();
    nlohmann::json report;
    {
        ProgressBar bar(arguments.common.quiet);
        report = shot::runExtractJob(job, [&](const shot::Progress& progress) {
            bar.show(progress);
            return isInterrupted() ? shot::Verdict::Stop : shot::Verdict::Continue;
        });
    }
    for (const auto& sentence : report["repaired"]["frames"]) log::warning("{}", sentence.get<std::string>());
    if (const auto repaired = report["repaired"]["values"].get<std::size_t>(); repaired > 0)
        log::warning("{} values of the footage were NaN or infinite; alpha is carried over them", repaired);
    if (arguments.common.json)
        std::printf("%s\n", report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
    const auto& rain = report["rain"];
    if (rain["found"].is_boolean() && rain["found"].get<bool>())
        log::info("'{}': {} frames in {:.1f} s: rain at {:.1f} degrees, {:.0f} strokes a frame, {} in the atlas",
                  job.output, report["footage"]["frames"].get<int>(), report["seconds"]["total"].get<double>(),
                  rain["slant_deg"].get<double>(), rain["strokes_per_frame"].get<double>(),
                  report["atlas"].is_null() ? 0 : report["atlas"]["strokes"].get<int>());
    if (report.value("stopped", false)) {
        log::warning("stopped on request after {} frames; they are whole", report["footage"]["frames"].get<int>());
        return exitCode(ErrorCode::Interrupted);
    }
    return 0;
}

}  // namespace

Runner addExtractCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("extract", "rain out of footage: mattes, clean plate, stroke atlas");
    command->footer(examples);
    const auto arguments = std::make_shared<ExtractArguments>();
    ExtractArguments& a = *arguments;
    shot::ExtractJobOptions& job = a.job;
    command
        ->add_option("FOOTAGE", job.footage,
                     "a movie or a pattern (shot.%04d.exr, shot.####.exr); with --stack one image")
        ->required();
    const char* group = "In and out";
    const auto add = [&](const char* flag, auto& value, const char* help, const char* type) {
        return command->add_option(flag, value, help)->type_name(type)->group(group);
    };
    const auto flag = [&](const char* name, bool& value, const char* help) {
        command->add_flag(name, value, help)->group(group);
    };
    add("-o,--output", job.output, "the folder that everything goes into; made if it is not there", "DIR")->required();
    add("--frames", job.frames, "which frames: 1-100, 1-10x2, several separated by commas (default all)", "RANGE");
    add("--clean", job.clean,
        "the footage without rain, in that folder: a pattern or a movie; none (default clean.####.exr)", "NAME");
    flag("--confidence", job.confidence, "write confidence.####.exr: how much each alpha rests on data");
    flag("--half", job.half, "write EXR as 16-bit half float (default for footage of up to 10 bits)");
    flag("--float", job.floats, "write EXR as 32-bit float (default for the rest)");
    add("--colorspace", job.colorspace,
        "of the footage, by name (default by metadata, else a guess; virga info --colorspaces)", "NAME");
    addOcioFlag(*command, job.ocio, group);
    flag("--linear", job.linear, "the values are linear light as they stand, and the model holds in them");
    add("--stack", a.stack, "the footage is one image of so many frames, top to bottom", "N");
    add("--fps", job.fps, "frames a second (default the footage's)", "1/s");
    add("--stream", job.stream, "which of a movie's video streams, counted from 0 (virga info FOOTAGE lists them)",
        "N");
    add("--layer", job.layer, "layer of EXR footage: diffuse for diffuse.R, .G and .B", "NAME");
    add("--view", job.view, "view of stereo EXR footage: right", "NAME");
    flag("--deinterlace", job.deinterlace, "make frames of interlaced pictures");
    add("--on-error", job.onError, "what to do with a frame that cannot be read (default stop)", "stop|skip|hold");
    group = "Model";
    add("--rain-color", a.color,
        "what drops return of the light, scene-linear; auto: from the strokes, else from the surroundings", "R,G,B");
    add("--slant", a.slant, "of the rain from vertical, the lower end to the right; auto: found", "deg");
    add("--space", job.space, "values that the model holds in; auto: where noise is even (default auto)",
        "auto|linear|display");
    add("--window", job.window, "frames that are solved together (default 20; 4 to 1000)", "N");
    add("--iterations", job.iterations, "rounds of alphas and scene (default 3; with --paper 20)", "N");
    add("--lambda", job.lambda, "smoothness of the scene (default from the noise; with --paper 1/20)", "L");
    add("--mu", job.mu, "smoothness of alpha along the rain (default from the noise; with --paper 1/4)", "M");
    add("--tolerance", job.tolerance, "of alpha, for steps that iterate (default 1e-4)", "T");
    command->add_flag("!--still", job.movers, "nothing but rain moves: do not look for people, cars, leaves")
        ->group(group);
    flag("--stabilize", job.stabilize, "register the frames first: a camera that shakes or pans slowly");
    flag("--force", job.force, "go on where no scene stands still behind the rain");
    flag("--paper", job.paper, "Wang et al. 2006 as it is written: no bounds, no costs, no weights");
    group = "Strokes";
    add("--strokes", job.strokes, "at most so many in the atlas (default 64; 1 to 4096)", "N");
    add("--tile", a.tile, "texels of a tile, 16x64; auto: as much as half of the strokes have (default 16x64)", "WxH");
    add("--exposure", job.exposure_s, "of the footage, if it is known (default estimated)", "s");
    add("--fov", job.fov_deg, "horizontal field of view of the footage (default 60)", "deg");
    addCommonFlags(*command, a.common);
    return
        [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return extract(*arguments); }); };
}

}  // namespace virga::cli
