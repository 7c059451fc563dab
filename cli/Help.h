// The pages of --help: one column of flags with their units, one of help, wrapped to the terminal.
#pragma once

#include <CLI/CLI.hpp>

namespace virga::cli {

/// Gives a command (and those added to it later) our pages.
void useHelpPages(CLI::App& app);

}  // namespace virga::cli
