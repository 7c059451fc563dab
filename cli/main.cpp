// virga COMMAND: rain for film and video. Parses, hands over to a command, translates errors into exit codes.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "Command.h"
#include "Help.h"
#include "core/Error.h"
#include "core/Words.h"
#include "shot/Parameters.h"

namespace {

using namespace virga;

/// Long names of a command's flags, and the commands themselves for the top level.
std::vector<std::string> knownWords(const CLI::App& command)
{
    std::vector<std::string> words;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    for (const CLI::App* sub : command.get_subcommands([](const CLI::App*) { return true; }))
        words.push_back(sub->get_name());
    return words;
}

/// The word that the command line stumbled over and the nearest one that exists.
std::string suggestion(const CLI::App& command, int argc, char** argv)
{
    const std::vector<std::string> known = knownWords(command);
    for (int i = 1; i < argc; ++i) {
        const std::string word = std::string(argv[i]).substr(0, std::string(argv[i]).find('='));
        const bool isFlag = word.starts_with("--");
        const bool isCommand = i == 1 && !word.starts_with("-");
        if ((!isFlag && !isCommand) || std::find(known.begin(), known.end(), word) != known.end()) continue;
        if (isCommand && command.get_parent() != nullptr) continue;
        const std::string nearest = nearestWord(word, known);
        return fmt::format("'{}' is not a {} of 'virga{}{}'{}", word, isFlag ? "flag" : "command",
                           command.get_parent() ? " " : "", command.get_parent() ? command.get_name() : "",
                           nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
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
        return command.get_parent() == nullptr ? "no command is given; there are rain and info" : text;
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
        if (text.ends_with("missing")) return fmt::format("{} needs a value", option);
        if (text.find("At Most") != std::string::npos) return fmt::format("{} is given more than once", option);
        return text;
    }
    if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
        if (rest.starts_with('-')) return fmt::format("'{}' is not a flag of 'virga {}'", rest, command.get_name());
        return fmt::format("'{}' is one argument too many", rest);
    }
    // A check of ours: "--device: 'foo': must be ...".
    if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) return fmt::format("{} {}", option, rest);
    return text;
}

}  // namespace

int main(int argc, char** argv)
{
    CLI::App app("virga: rain for film and video", "virga");
    app.set_version_flag("--version", "virga " VIRGA_VERSION, "the version");
    app.require_subcommand(1);
    app.set_help_flag("-h,--help", "this page; 'virga COMMAND --help' has the flags of a command");
    cli::useHelpPages(app);
    std::vector<std::pair<CLI::App*, cli::Runner>> commands(2);
    commands[0].second = cli::addRainCommand(app, commands[0].first);
    commands[1].second = cli::addInfoCommand(app, commands[1].first);

    const CLI::App* chosen = &app;
    for (const auto& [command, runner] : commands)
        if (argc > 1 && command->get_name() == argv[1]) chosen = command;
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {  // --help, --version
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        std::string sentence = suggestion(*chosen, argc, argv);
        if (sentence.empty()) sentence = complaint(error, *chosen);
        std::fprintf(stderr, "virga: %s (virga%s%s --help lists everything)\n", sentence.c_str(),
                     chosen == &app ? "" : " ", chosen == &app ? "" : chosen->get_name().c_str());
        return exitCode(ErrorCode::InvalidArgument);
    }
    for (const auto& [command, runner] : commands)
        if (command->parsed()) return runner();
    return 0;
}
