// virga COMMAND: rain for film and video. Parses, hands over to a command, translates errors into exit codes.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "Command.h"
#include "Help.h"
#include "core/Error.h"
#include "core/Words.h"
#include "shot/Parameters.h"

namespace {

using namespace virga;

/// Every command, in the order of the help page.
constexpr cli::Runner (*commandTable[])(CLI::App&, CLI::App*&) = {
    cli::addRainCommand,  cli::addExtractCommand, cli::addEnvCommand, cli::addModelCommand,
    cli::addServeCommand, cli::addBenchCommand,   cli::addInfoCommand};

std::vector<std::string> subcommandNames(const CLI::App& command)
{
    std::vector<std::string> names;
    for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(sub->get_name());
    return names;
}

/// Long names of a command's flags, and the commands below it.
std::vector<std::string> knownWords(const CLI::App& command)
{
    std::vector<std::string> words = subcommandNames(command);
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    return words;
}

/// "rain, model and info".
std::string listed(const std::vector<std::string>& words)
{
    std::string text;
    for (std::size_t i = 0; i < words.size(); ++i)
        text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
    return text;
}

/// The command that the line names, `virga` itself if none; depth: how many words name it.
const CLI::App& chosenCommand(const CLI::App& app, int argc, char** argv, int& depth)
{
    const CLI::App* command = &app;
    for (depth = 0; depth + 1 < argc; ++depth) {
        const auto named = [&](const CLI::App* sub) { return sub->get_name() == argv[depth + 1]; };
        const std::vector<const CLI::App*> subs = command->get_subcommands(named);
        if (subs.empty()) break;
        command = subs.front();
    }
    return *command;
}

/// The word that the command line stumbled over and the nearest one that exists.
std::string suggestion(const CLI::App& command, int depth, int argc, char** argv)
{
    const std::vector<std::string> known = knownWords(command), commands = subcommandNames(command);
    for (int i = 1; i < argc; ++i) {
        const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
        const bool isFlag = word.starts_with("--");
        const bool isCommand = i == depth + 1 && !word.starts_with("-") && !commands.empty();
        if ((!isFlag && !isCommand) || std::find(known.begin(), known.end(), word) != known.end()) continue;
        const std::string nearest = nearestWord(word, known);
        return fmt::format("'{}' is not a {} of '{}'{}", word,
                           isFlag                          ? "flag"
                           : depth == 0                    ? "command"
                           : command.get_name() == "model" ? "model"
                                                           : "part",
                           cli::fullName(command),
                           !nearest.empty() ? fmt::format("; did you mean '{}'?", nearest)
                           : isCommand      ? fmt::format("; there are {}", listed(commands))
                                            : "");
    }
    return {};
}

/// CLI11's complaint as one of our sentences.
std::string complaint(const CLI::ParseError& error, const CLI::App& command)
{
    std::string text = error.what();
    const std::string option = text.substr(0, text.find(':'));
    const std::string rest = text.substr(std::min(text.find(": ") + 2, text.size()));
    if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr)
        return subcommandNames(command).empty()
                   ? text
                   : fmt::format("no {} is given; there are {}", command.get_parent() == nullptr ? "command" : "part",
                                 listed(subcommandNames(command)));
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
        if (text.ends_with("missing")) return fmt::format("{} needs a value", option);
        if (text.find("At Most") != std::string::npos) return fmt::format("{} is given more than once", option);
        return text;
    }
    if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
        if (rest.starts_with('-')) return fmt::format("'{}' is not a flag of '{}'", rest, cli::fullName(command));
        return fmt::format("'{}' is one argument too many", rest);
    }
    if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) {  // "Could not convert: --window = x"
        const std::string flag = rest.substr(0, rest.find(" = "));
        const std::string value = rest.substr(std::min(flag.size() + 3, rest.size()));
        char* end = nullptr;
        std::strtod(value.c_str(), &end);
        const bool isNumber = !value.empty() && *end == 0;
        return fmt::format("{} '{}': must be a {}", flag, value, isNumber ? "whole number" : "number");
    }
    // A check of ours: "--device: 'foo': must be ...".
    if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) return fmt::format("{} {}", option, rest);
    return text;
}

/// Readers that go away and files that may grow no further are errors to be told, not signals to die of. And whoever
/// starts us without standard streams must not have what we print in the first file that is opened.
void settleStreams()
{
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
    for (int file = open("/dev/null", O_RDONLY); file >= 0; file = open("/dev/null", O_RDONLY))
        if (file > STDERR_FILENO) {
            close(file);
            break;
        }
}

}  // namespace

int main(int argc, char** argv)
{
    settleStreams();
    CLI::App app("virga: rain for film and video", "virga");
    app.set_version_flag("--version", "virga " VIRGA_VERSION, "the version");
    app.require_subcommand(1);
    app.set_help_flag("-h,--help", "this page; 'virga COMMAND --help' has the flags of a command");
    cli::useHelpPages(app);
    std::vector<std::pair<CLI::App*, cli::Runner>> commands;
    for (const auto add : commandTable) {
        CLI::App* command = nullptr;
        cli::Runner runner = add(app, command);
        commands.emplace_back(command, std::move(runner));
    }

    int depth = 0;
    const CLI::App& chosen = chosenCommand(app, argc, argv, depth);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {  // --help, --version
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        std::string sentence = suggestion(chosen, depth, argc, argv);
        if (sentence.empty()) sentence = complaint(error, chosen);
        std::fprintf(stderr, "virga: %s (%s --help lists everything)\n", sentence.c_str(),
                     cli::fullName(chosen).c_str());
        return exitCode(ErrorCode::InvalidArgument);
    }
    for (const auto& [command, runner] : commands)
        if (command->parsed()) return runner();
    return 0;
}
