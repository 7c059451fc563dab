// virga COMMAND: rain for film and video. Parses, hands over to a command, translates errors into exit codes.
#include <cstdio>
#include <string>
#include <vector>

#include "Command.h"
#include "core/Error.h"
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
        const std::string nearest = shot::nearestWord(word, known);
        return fmt::format("'{}' is not a {} of 'virga{}{}'{}", word, isFlag ? "flag" : "command",
                           command.get_parent() ? " " : "", command.get_parent() ? command.get_name() : "",
                           nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
    }
    return {};
}

}  // namespace

int main(int argc, char** argv)
{
    CLI::App app("virga: rain for film and video", "virga");
    app.set_version_flag("--version", "virga " VIRGA_VERSION);
    app.require_subcommand(1);
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
        if (sentence.empty()) sentence = error.what();
        std::fprintf(stderr, "virga: %s (virga%s%s --help lists everything)\n", sentence.c_str(),
                     chosen == &app ? "" : " ", chosen == &app ? "" : chosen->get_name().c_str());
        return exitCode(ErrorCode::InvalidArgument);
    }
    for (const auto& [command, runner] : commands)
        if (command->parsed()) return runner();
    return 0;
}
