#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <memory>

#include "Command.h"
#include "Interrupt.h"
#include "ProgressBar.h"
#include "core/Error.h"
#include "core/KeptFiles.h"
#include "core/Log.h"
#include "io/AtomicFile.h"
#include "shot/Parameters.h"
#include "shot/Preflight.h"
#include "shot/RainJob.h"

namespace virga::cli {
namespace {

struct RainArguments {
    CommonFlags common;
    shot::RainJobOptions job;
    std::string settingsFile, matchFile, saveSettings;
    std::string reference;  // "" not asked for
    int referenceSamples = shot::ReferenceOptions().samples;
    bool explain = false, half = false, check = false, noCache = false;
    std::vector<std::string> values;    // one text a parameter, in the table's order
    std::vector<CLI::Option*> options;  // the same
};

const char* const examples = R"(Examples:
  virga rain street.mp4 -o street_rain.mp4 --rate 25
  virga rain shot.%04d.exr -o rain.%04d.exr --depth z.%04d.exr --camera shot.chan --layers
  virga rain night.mov -o night_rain.mov --env street_hdri.exr --fog 0.004 --darken 0
  virga rain road.mp4 -o storm.mp4 --rate 80 --wind 4,1 --gust 2 --ground 1.5,4
  virga rain shot.mp4 -o out.mp4 --settings look.toml --seed 7 --explain
  virga rain shot.%04d.exr -o rain.%04d.exr --depth z.%04d.exr --camera shot.chan --check
  virga rain dry.mp4 -o wet.mp4 --match extracted/report.json
A switch that a settings file turns on is turned off by =false: --paper=false)";

/// What stands for the value on the help page: the unit, or the kind of text.
std::string valueName(const shot::Parameter& p)
{
    using shot::Settings;
    if (p.choices != nullptr) return p.choices;
    std::string unit = *p.unit ? p.unit : "N";
    if (std::holds_alternative<std::array<double, 2> Settings::*>(p.member)) return unit + "," + unit;
    if (std::holds_alternative<shot::AutoColor Settings::*>(p.member)) return "R,G,B";
    if (!std::holds_alternative<std::string Settings::*>(p.member)) return unit;
    if (std::string_view(p.name) == "ground") return "m[,deg]";
    for (const std::string_view file : {"mattes", "camera", "env", "lights", "depth", "grade-from", "ocio"})
        if (file == p.name) return "FILE";
    return "NAME";
}

/// "how much rain falls (default 25; 0 to 2000)".
std::string helpOf(const shot::Parameter& p)
{
    const std::string standard = shot::toText(shot::Settings(), p);
    const std::string range = p.choices != nullptr ? "" : shot::rangeText(p);
    if (p.isSwitch() || (standard.empty() && range.empty())) return p.help;
    return fmt::format("{} (default {}{}{})", p.help, standard, range.empty() ? "" : "; ", range);
}

std::string groupTitle(std::string_view group)
{
    std::string title(group);
    title[0] = char(std::toupper(static_cast<unsigned char>(title[0])));
    return title;
}

shot::Settings gatherSettings(const RainArguments& arguments)
{
    shot::Settings settings;
    if (!arguments.settingsFile.empty()) shot::loadSettings(settings, arguments.settingsFile);
    if (!arguments.matchFile.empty()) shot::loadMatch(settings, arguments.matchFile);
    const auto table = shot::parameters();
    const auto isTyped = [&](std::string_view name) {
        const auto at = std::find_if(table.begin(), table.end(), [&](const auto& p) { return name == p.name; });
        return arguments.options[std::size_t(at - table.begin())]->count() > 0;
    };
    for (std::size_t i = 0; i < table.size(); ++i) {
        if (arguments.options[i]->count() == 0) continue;
        shot::setFromText(settings, table[i], arguments.values[i]);
    }
    // An exposure outranks a shutter, but not a file's exposure a shutter that was typed.
    if (isTyped("shutter") && !isTyped("exposure")) settings.exposure_s.reset();
    return settings;
}

/// The pre-flight: says what does not fit, and renders nothing.
int check(const RainArguments& arguments, const shot::Settings& settings, const shot::RainJobOptions& job)
{
    if (!arguments.saveSettings.empty())
        throw Error(ErrorCode::InvalidArgument, "--check writes nothing: leave out --save-settings");
    const std::vector<shot::Finding> findings = shot::checkRainJob(settings, job);
    if (arguments.common.json)
        std::printf("%s\n", shot::findingsJson(findings).c_str());
    else
        std::fputs(shot::findingsTable(findings).c_str(), stdout);
    return shot::holdsError(findings) ? exitCode(ErrorCode::Input) : 0;
}

int rain(const RainArguments& arguments)
{
    const shot::Settings settings = gatherSettings(arguments);
    shot::RainJobOptions job = arguments.job;
    job.device = arguments.common.device;
    if (arguments.half && settings.floatOutput)
        throw Error(ErrorCode::InvalidArgument, "--half and --float exclude each other");
    if (arguments.half) job.half = true;
    if (!arguments.reference.empty())
        job.reference = shot::ReferenceOptions{.allDrops = shot::drawsAllDrops(arguments.reference),
                                               .samples = arguments.referenceSamples};
    if (!arguments.noCache) job.cacheFolder = keptFilesFolder();
    if (arguments.check) return check(arguments, settings, job);
    if (!arguments.saveSettings.empty()) {
        if (io::isSameFile(arguments.saveSettings, job.plate))
            throw Error(ErrorCode::Output, "--save-settings '{}': is the plate itself", arguments.saveSettings);
        shot::saveSettings(settings, arguments.saveSettings);
    }

    if (arguments.explain)
        job.onPlan = [](const std::vector<shot::MemoryUse>& uses) {
            std::fputs(fmt::format("{:<17} {:<19} {}\n", "memory", "on", shot::memoryWords(uses)).c_str(), stderr);
        };
    noteInterrupts();
    shot::RainReport report;
    {
        ProgressBar bar(arguments.common.quiet);
        report = shot::runRainJob(settings, job, [&](const shot::Progress& progress) {
            bar.show(progress);
            return isInterrupted() ? shot::Verdict::Stop : shot::Verdict::Continue;
        });
    }
    const shot::CompositorStatistics& s = report.statistics;
    if (s.repairedPixels > 0)
        log::warning("{} values of the plate were NaN or infinite and were repaired", s.repairedPixels);
    if (arguments.explain) std::fputs(shot::explain(report.plan, &s).c_str(), stderr);
    if (arguments.common.json) std::printf("%s\n", shot::reportJson(report, settings).c_str());

    const double frames = double(report.frames.size());
    log::info("'{}': {} frame{} in {:.1f} s ({:.1f} fps){}", job.output, report.frames.size(),
              report.frames.size() == 1 ? "" : "s", report.seconds, report.seconds > 0 ? frames / report.seconds : 0,
              report.isStreamCopy ? ", copied as they are"
              : s.device.empty()  ? ", nothing to render"
                                  : fmt::format(", {:.0f} strokes a frame, {:.1f} ms a frame rendering on {}",
                                                double(s.strokes) / frames, 1e3 * s.renderSeconds / frames, s.device));
    if (report.stopped) {
        log::warning("stopped on request after frame {}; what is written plays", report.frames.back());
        return exitCode(ErrorCode::Interrupted);
    }
    return 0;
}

}  // namespace

Runner addRainCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("rain", "rain onto a plate");
    command->footer(examples);
    const auto arguments = std::make_shared<RainArguments>();
    RainArguments& a = *arguments;
    const char* const group = "In and out";
    command->add_option("PLATE", a.job.plate, "a movie, an image, or a pattern (shot.%04d.exr, shot.####.exr)")
        ->required();
    command->add_option("-o,--output", a.job.output, "a movie, an image, or a pattern")
        ->required()
        ->type_name("OUT")
        ->group(group);
    command
        ->add_option("--frames", a.job.frames, "which frames: 1-100, 1-10x2, several separated by commas (default all)")
        ->type_name("RANGE")
        ->group(group);
    command
        ->add_flag("--layers", a.job.layers,
                   "write the layers rain, splash, fog and plate into the EXR, and rain.Z and rain.motion")
        ->group(group);
    command->add_flag("--half", a.half, "write EXR as 16-bit half float, whatever the plate is")->group(group);
    command
        ->add_flag(
            "--resume", a.job.resume,
            "frames of a sequence that are there, whole and made with the same settings from the same files, stay")
        ->group(group);
    command->add_option("--preview", a.job.preview, "write a contact sheet before/after")
        ->type_name("PNG")
        ->group(group);
    command
        ->add_option("--timeline", a.job.timeline,
                     "write what each thread did when, for chrome://tracing or ui.perfetto.dev (docs/timeline.md)")
        ->type_name("JSON")
        ->group(group);
    command->add_option("--settings", a.settingsFile, "read settings from a file; flags override it")
        ->type_name("TOML")
        ->group(group);
    command
        ->add_option("--match", a.matchFile,
                     "rain like that in other footage: the report.json of virga extract; overrides --settings, flags "
                     "override it")
        ->type_name("JSON")
        ->group(group);
    command->add_option("--save-settings", a.saveSettings, "write all settings to a file")
        ->type_name("TOML")
        ->group(group);
    command->add_flag("--explain", a.explain, "print each pass: on or skipped, why, and what it cost")->group(group);
    command
        ->add_flag(
            "--check", a.check,
            "read the headers of all inputs, say what does not fit, and render nothing; exit code 3 if something "
            "would end the work")
        ->group(group);
    // A flag, so that it does not take the plate for its value.
    command
        ->add_flag("--reference{all}", a.reference,
                   "render by the slow, exact reference instead, with every drop drawn and none folded into fog, to "
                   "check the renderer by; --reference=drawn: with the drops that it draws (docs/reference.md)")
        ->group(group);
    command
        ->add_option("--reference-samples", a.referenceSamples,
                     "samples of the reference along the edge of a pixel (default 16; 1 to 256)")
        ->type_name("N")
        ->group(group);
    command->add_option("--shader-dir", a.job.shaderFolder, "take shaders from this folder (for developing)")
        ->type_name("FOLDER")
        ->group(group);

    command
        ->add_flag("--no-cache", a.noCache,
                   "neither use nor keep compiled shaders and the light of panoramas (in XDG_CACHE_HOME/virga)")
        ->group(group);

    const auto table = shot::parameters();
    a.values.resize(table.size());
    for (std::size_t i = 0; i < table.size(); ++i) {
        const shot::Parameter& p = table[i];
        const std::string flag = "--" + std::string(p.name);
        // A switch never takes the word after it, which may be the plate; --paper=false undoes a settings file.
        CLI::Option* option = p.isSwitch() ? command->add_flag(flag, a.values[i], helpOf(p))
                                           : command->add_option(flag, a.values[i], helpOf(p))->type_name(valueName(p));
        a.options.push_back(option->group(groupTitle(p.group)));
    }
    addCommonFlags(*command, a.common);
    return [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return rain(*arguments); }); };
}

}  // namespace virga::cli
