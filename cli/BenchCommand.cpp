#include <cstdio>
#include <cstdlib>
#include <memory>

#include "Command.h"
#include "bench/Curves.h"
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
    command.add_option("--values", options.values, "set the knob to these in the place of its own")
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

}  // namespace

Runner addBenchCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("bench", "run time against error, on this machine");
    command->require_subcommand(1);
    std::vector<std::pair<CLI::App*, Runner>> parts;
    CLI::App* const part =
        command->add_subcommand("curves", "each knob's error against its time: tables, charts, a page");
    parts.emplace_back(part, addCurves(*part));
    return [parts] {
        for (const auto& [part, runner] : parts)
            if (part->parsed()) return runner();
        return 0;
    };
}

}  // namespace virga::cli
