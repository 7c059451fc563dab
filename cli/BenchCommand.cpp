#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "Command.h"
#include "bench/Curves.h"
#include "bench/EndToEnd.h"
#include "bench/PaperTables.h"
#include "core/Error.h"
#include "core/Log.h"

namespace virga::cli {
namespace {

struct CurveArguments {
    CommonFlags common;
    bench::CurveOptions options;
};

int curves(const CurveArguments& arguments)
{
    if (arguments.common.json)
        throw Error(ErrorCode::InvalidArgument, "--json: the curves' tables are CSV, in --output");
    log::setLevel(log::Level::Quiet);  // of depth that is resampled, many times over
    bench::runCurves(arguments.options, [&](const std::string& knob, double seconds) {
        if (!arguments.common.quiet) std::fprintf(stderr, "%s: %.1f s\n", knob.c_str(), seconds);
    });
    if (!arguments.common.quiet) std::fprintf(stderr, "%s/index.html\n", arguments.options.out.c_str());
    return 0;
}

Runner addCurves(CLI::App& command)
{
    const auto arguments = std::make_shared<CurveArguments>();
    bench::CurveOptions& options = arguments->options;
    if (const char* folder = std::getenv("VIRGA_FOOTAGE_DIR")) options.footage = folder;
    command.footer(
        "Examples:\n"
        "  virga bench curves -o curves\n"
        "  virga bench curves -o curves --only threshold --opacity 1 --seeds 5\n");
    command
        .add_option("-o,--output", options.out, "folder for tables, charts, pictures and index.html (default bench)")
        ->type_name("DIR");
    command.add_option("--only", options.only, "this knob alone; several with commas (default all)")
        ->delimiter(',')
        ->type_name("KNOB,...");
    command
        .add_option("--values", options.values, "set the knob to these and its default, in the place of its own values")
        ->delimiter(',')
        ->type_name("X,...");
    command.add_option("--samples", options.samples, "folder of the sample street (default samples)")->type_name("DIR");
    command
        .add_option("--footage", options.footage,
                    "folder with three more clips (default $VIRGA_FOOTAGE_DIR; \"\" for none)")
        ->type_name("DIR");
    command
        .add_option("--columns", options.columns, "plates are averaged down to about so many (default 96; 16 to 1024)")
        ->type_name("N")
        ->check(CLI::Range(16, 1024));
    command.add_option("--seeds", options.seeds, "seeds 1 to N (default 3; to 100)")
        ->type_name("N")
        ->check(CLI::Range(1, 100));
    command.add_option("--opacity", options.opacity, "of the strokes (default virga rain's; 0 to 100)")
        ->type_name("X")
        ->check(CLI::Range(0.0, 100.0));
    addCommonFlags(command, arguments->common);
    return
        [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return curves(*arguments); }); };
}

struct TableArguments {
    CommonFlags common;
    bench::TableOptions options;
};

int tables(TableArguments& arguments)
{
    arguments.options.device = arguments.common.device;
    const auto results = bench::runPaperTables(arguments.options, [&](const bench::PaperResult& result) {
        if (!arguments.common.quiet)
            std::fprintf(stderr, "%s, %s, %s\n", result.of.paper.c_str(), result.of.table.c_str(),
                         result.of.what.c_str());
    });
    const std::string text =
        arguments.common.json ? bench::paperTablesJson(results).dump(2) + "\n" : bench::paperTablesText(results);
    std::fputs(text.c_str(), stdout);
    return 0;
}

Runner addTables(CLI::App& command)
{
    const auto arguments = std::make_shared<TableArguments>();
    bench::TableOptions& options = arguments->options;
    command.footer(
        "Examples:\n"
        "  virga bench tables\n"
        "  virga bench tables --only wang --device cpu --json\n");
    command.add_option("--only", options.only, "wang, nvidia, rousseau; several with commas (default all)")
        ->delimiter(',')
        ->type_name("PAPER,...");
    command
        .add_option("--frames", options.frames, "timed in each case, after one that warms up (default 5; 1 to 1000)")
        ->type_name("N")
        ->check(CLI::Range(1, 1000));
    command.add_option("--largest", options.largest, "leave out cases of more drops (default 5e6, all; from 1000)")
        ->type_name("N")
        ->check(CLI::Range(1e3, 1e9));
    addCommonFlags(command, arguments->common);
    return
        [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return tables(*arguments); }); };
}

struct EndToEndArguments {
    CommonFlags common;
    bench::EndToEndOptions options;
};

int endToEnd(EndToEndArguments& arguments)
{
    arguments.options.device = arguments.common.device;
    arguments.options.virga = std::filesystem::read_symlink("/proc/self/exe").string();
    const bench::EndToEndReport report = bench::runEndToEnd(arguments.options);
    const std::string text =
        arguments.common.json ? bench::endToEndJson(report).dump(2) + "\n" : bench::endToEndText(report);
    std::fputs(text.c_str(), stdout);
    return 0;
}

Runner addEndToEnd(CLI::App& command)
{
    const auto arguments = std::make_shared<EndToEndArguments>();
    bench::EndToEndOptions& options = arguments->options;
    command.footer(
        "Examples:\n"
        "  virga bench e2e clip.mp4\n"
        "  virga bench e2e clip.mp4 --codec libx265 --quality 20 -- --strokes 80000 --fov 60\n");
    command.add_option("MOVIE", options.movie, "what is read")->required();
    command.add_option("FLAGS", options.rainFlags, "after --: more flags of virga rain");
    command.add_option("-o,--output", options.out, "folder that keeps both movies, plain.* and rain.*")
        ->type_name("DIR");
    command.add_option("--codec", options.codec, "of both (default libx264; libx265, libsvtav1, libvpx-vp9)")
        ->type_name("NAME");
    command.add_option("--quality", options.quality, "CRF of both (default 18; 0 to 63)")
        ->type_name("X")
        ->check(CLI::Range(0.0, 63.0));
    command.add_option("--runs", options.runs, "of each, in turn; medians count (default 3; 1 to 99)")
        ->type_name("N")
        ->check(CLI::Range(1, 99));
    addCommonFlags(command, arguments->common);
    return
        [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return endToEnd(*arguments); }); };
}

}  // namespace

Runner addBenchCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("bench", "run time against error, on this machine");
    command->require_subcommand(1);
    std::vector<std::pair<CLI::App*, Runner>> parts;
    const auto add = [&](const char* name, const char* help, Runner (*fill)(CLI::App&)) {
        CLI::App* const part = command->add_subcommand(name, help);
        parts.emplace_back(part, fill(*part));
    };
    add("curves", "each knob's error against its time: tables, charts, a page", addCurves);
    add("tables", "frame rates that papers on rain print, measured here", addTables);
    add("e2e", "virga rain on a movie against a plain ffmpeg transcode", addEndToEnd);
    return [parts] {
        for (const auto& [part, runner] : parts)
            if (part->parsed()) return runner();
        return 0;
    };
}

}  // namespace virga::cli
