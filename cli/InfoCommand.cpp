#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "Command.h"
#include "InfoColor.h"
#include "InfoPlate.h"
#include "gl/Context.h"
#include "io/Versions.h"
#include "shot/Parameters.h"

namespace virga::cli {
namespace {

struct InfoArguments {
    CommonFlags common;
    bool parameters = false, colorspaces = false;
    std::string file, ocio;
    std::optional<int> stream;
};

int info(const InfoArguments& arguments)
{
    if (arguments.parameters) {
        std::fputs(shot::parametersPage().c_str(), stdout);
        return 0;
    }
    const auto print = [&](const nlohmann::json& report, const std::string& text) {
        // A file name need not be UTF-8; JSON must.
        const std::string said =
            arguments.common.json ? report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n" : text;
        std::fputs(said.c_str(), stdout);
        return 0;
    };
    if (arguments.colorspaces) {
        const nlohmann::json report = colorReport(arguments.ocio);
        return print(report, colorText(report));
    }
    if (!arguments.file.empty()) {
        const nlohmann::json report = plateReport(arguments.file, arguments.ocio, arguments.stream);
        return print(report, plateText(report));
    }
    const auto devices = gl::listDevices();
    const auto libraries = io::libraryVersions();
    if (arguments.common.json) {
        nlohmann::json object = {
            {"version", VIRGA_VERSION}, {"devices", nlohmann::json::array()}, {"libraries", libraries}};
        for (const gl::DeviceInfo& d : devices)
            object["devices"].push_back({{"index", d.index},
                                         {"renderer", d.renderer},
                                         {"vendor", d.vendor},
                                         {"version", d.version},
                                         {"software", d.isSoftware},
                                         {"platform", d.platform}});
        std::printf("%s\n", object.dump(2).c_str());
        return 0;
    }
    std::printf("virga %s\n", VIRGA_VERSION);
    for (const gl::DeviceInfo& d : devices)
        std::printf("device %d: %s (%s, OpenGL %s, EGL %s)\n", d.index, d.renderer.c_str(),
                    d.isSoftware ? "software" : "GPU", d.version.c_str(), d.platform.c_str());
    if (devices.empty())
        std::printf("no OpenGL 4.5 device; the processor draws without one\n");
    for (const auto& [name, version] : libraries) std::printf("%s %s\n", name.c_str(), version.c_str());
    return 0;
}

}  // namespace

Runner addInfoCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("info", "GL devices, library versions; what a plate is; colour spaces");
    const auto arguments = std::make_shared<InfoArguments>();
    command->add_option("PLATE", arguments->file, "a movie, an image, or a pattern: what its header says");
    command->add_option("--stream", arguments->stream, "which of the movie's video streams, counted from 0")
        ->type_name("N")
        ->check(CLI::Range(0, 1000));
    command->add_flag("--colorspaces", arguments->colorspaces, "names that --colorspace understands, and roles");
    addOcioFlag(*command, arguments->ocio, "OPTIONS");
    command->add_flag("--parameters", arguments->parameters, "print docs/parameters.md");
    addCommonFlags(*command, arguments->common);
    return [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return info(*arguments); }); };
}

}  // namespace virga::cli
