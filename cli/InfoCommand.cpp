#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "Command.h"
#include "gl/Context.h"
#include "io/Versions.h"
#include "shot/Parameters.h"

namespace virga::cli {
namespace {

struct InfoArguments {
    CommonFlags common;
    bool parameters = false;
};

int info(const InfoArguments& arguments)
{
    if (arguments.parameters) {
        std::fputs(shot::parametersPage().c_str(), stdout);
        return 0;
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
        std::printf("no OpenGL 4.5 device: 'apt-get install libegl1 libgl1-mesa-dri' brings a software renderer\n");
    for (const auto& [name, version] : libraries) std::printf("%s %s\n", name.c_str(), version.c_str());
    return 0;
}

}  // namespace

Runner addInfoCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("info", "GL devices, library versions; what is missing and how to get it");
    const auto arguments = std::make_shared<InfoArguments>();
    command->add_flag("--parameters", arguments->parameters, "print docs/parameters.md");
    addCommonFlags(*command, arguments->common);
    return [arguments] { return runCommand(arguments->common, [&](const CommonFlags&) { return info(*arguments); }); };
}

}  // namespace virga::cli
