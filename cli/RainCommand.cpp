#include <atomic>
#include <csignal>
#include <cstdio>
#include <memory>
#include <unistd.h>

#include "Command.h"
#include "ProgressBar.h"
#include "core/Error.h"
#include "core/Log.h"
#include "shot/Parameters.h"
#include "shot/RainJob.h"

namespace virga::cli {
namespace {

volatile std::sig_atomic_t interrupted = 0;

/// The first Ctrl-C lets the current frame finish and closes the movie; the second ends at once.
void onInterrupt(int)
{
    if (interrupted != 0) _exit(exitCode(ErrorCode::Interrupted));
    interrupted = 1;
}

struct RainArguments {
    CommonFlags common;
    shot::RainJobOptions job;
    std::string settingsFile, saveSettings;
    bool explain = false, half = false;
    std::vector<std::string> values;     // one text a parameter, in the table's order
    std::vector<CLI::Option*> options;   // the same
};

const char* const examples = R"(Examples:
  virga rain street.mp4 -o street_rain.mp4 --rate 25
  virga rain shot.%04d.exr -o rain.%04d.exr --frames 1001-1096 --depth z.%04d.exr --camera shot.chan --layers
  virga rain night.mov -o night_rain.mov --env street_hdri.exr --fog 0.004 --darken 0
  virga rain road.mp4 -o storm.mp4 --rate 80 --wind 4,1 --gust 2 --ground 1.5,4
  virga rain shot.mp4 -o out.mp4 --settings look.toml --seed 7 --explain)";

shot::Settings gatherSettings(const RainArguments& arguments)
{
    shot::Settings settings;
    if (!arguments.settingsFile.empty()) shot::loadSettings(settings, arguments.settingsFile);
    const auto table = shot::parameters();
    for (std::size_t i = 0; i < table.size(); ++i) {
        if (arguments.options[i]->count() == 0) continue;
        shot::setFromText(settings, table[i], table[i].isSwitch() && arguments.values[i].empty() ? "true"
                                                                                                 : arguments.values[i]);
    }
    if (arguments.half) settings.floatOutput = false;
    return settings;
}

int rain(const RainArguments& arguments)
{
    const shot::Settings settings = gatherSettings(arguments);
    if (!arguments.saveSettings.empty()) shot::saveSettings(settings, arguments.saveSettings);

    std::signal(SIGINT, onInterrupt);
    std::signal(SIGTERM, onInterrupt);
    shot::RainReport report;
    {
        ProgressBar bar(arguments.common.quiet);
        report = shot::runRainJob(settings, arguments.job, [&](const shot::Progress& progress) {
            bar.show(progress);
            return interrupted != 0 ? shot::Verdict::Stop : shot::Verdict::Continue;
        });
    }
    const shot::CompositorStatistics& s = report.statistics;
    for (const std::string& sentence : report.repairedFrames) log::warning("{}", sentence);
    if (s.repairedPixels > 0) log::warning("{} values of the plate were NaN or infinite and were repaired", s.repairedPixels);
    if (arguments.explain) std::fputs(shot::explain(report.plan, &s).c_str(), stderr);
    if (arguments.common.json) std::printf("%s\n", shot::reportJson(report, settings).c_str());

    const double frames = double(report.frames.size());
    log::info("'{}': {} frames in {:.1f} s ({:.1f} fps){}", arguments.job.output, report.frames.size(), report.seconds,
              report.seconds > 0 ? frames / report.seconds : 0,
              s.device.empty() ? ", nothing to render"
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
    command->add_option("PLATE", a.job.plate, "a movie, an image, or a pattern (shot.%04d.exr, shot.####.exr)")->required();
    command->add_option("-o,--output", a.job.output, "a movie, an image, or a pattern")->required();
    command->add_option("--frames", a.job.frames, "which frames: 1-100, 1-10x2, several separated by commas");
    command->add_option("--settings", a.settingsFile, "read settings from a TOML file; flags override it");
    command->add_option("--save-settings", a.saveSettings, "write all settings to a TOML file");
    command->add_flag("--layers", a.job.layers, "write rain, splash, fog and plate as EXR layers, rain.Z and motion");
    command->add_flag("--half", a.half, "write EXR as half float (the default)");
    command->add_flag("--explain", a.explain, "print each pass: on or skipped, why, and what it cost");
    command->add_option("--preview", a.job.preview, "write a contact sheet before/after (PNG)");
    command->add_option("--shader-dir", a.job.shaderFolder, "take shaders from this folder (for developing)");
    addCommonFlags(*command, a.common);

    const auto table = shot::parameters();
    const shot::Settings defaults;
    a.values.resize(table.size());
    for (std::size_t i = 0; i < table.size(); ++i) {
        const shot::Parameter& p = table[i];
        const std::string standard = shot::toText(defaults, p);
        const std::string help = std::string(p.help) +
                                 (p.isSwitch() || standard.empty() ? "" : " (default " + standard + ")");
        CLI::Option* option = command->add_option("--" + std::string(p.name), a.values[i], help)->group(p.group);
        if (p.isSwitch())
            option->expected(0, 1)->type_name("[true|false]");
        else
            option->type_name(*p.unit ? p.unit : p.choices ? p.choices : p.most == 0 ? "TEXT" : "");
        a.options.push_back(option);
    }
    return [arguments] {
        arguments->job.device = arguments->common.device;
        return runCommand(arguments->common, [&](const CommonFlags&) { return rain(*arguments); });
    };
}

}  // namespace virga::cli
