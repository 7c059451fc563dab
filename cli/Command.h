// What the commands of `virga` share. docs/conventions.md has the contract: exit codes, what goes to which stream.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace virga::cli {

/// "virga", "virga rain", "virga model shape".
std::string fullName(const CLI::App& command);

/// Flags that every command has.
struct CommonFlags {
    bool quiet = false, verbose = false, json = false;
    int threads = 0;
    std::string device = "auto";
};

/// Adds --help, --quiet, --verbose, --json, --threads and --device, in a group of their own. Call it last.
void addCommonFlags(CLI::App& command, CommonFlags& flags);

/// Adds --ocio, for commands that do not have it from the table of settings.
void addOcioFlag(CLI::App& command, std::string& file, const char* group);

/// Sets log level and threads, runs `body`, and turns what it throws into a sentence on standard error and an exit
/// code.
int runCommand(const CommonFlags& flags, const std::function<int(const CommonFlags&)>& body);

/// Registers a command; returns what to call when it was chosen.
using Runner = std::function<int()>;
Runner addRainCommand(CLI::App& app, CLI::App*& command);
Runner addExtractCommand(CLI::App& app, CLI::App*& command);
Runner addEnvCommand(CLI::App& app, CLI::App*& command);
Runner addModelCommand(CLI::App& app, CLI::App*& command);
Runner addBenchCommand(CLI::App& app, CLI::App*& command);
Runner addServeCommand(CLI::App& app, CLI::App*& command);
Runner addInfoCommand(CLI::App& app, CLI::App*& command);

}  // namespace virga::cli
