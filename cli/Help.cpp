#include "Help.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

#include "Command.h"

namespace virga::cli {
namespace {

constexpr std::size_t left = 30;                                  // where the help column begins
constexpr std::size_t narrowest = 60, widest = 120, usual = 100;  // of a page [characters]

std::size_t pageWidth()
{
    winsize size{};
    if (isatty(STDOUT_FILENO) == 0 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return usual;
    return std::clamp<std::size_t>(size.ws_col, narrowest, widest);
}

/// "  what      help", the help wrapped at words and indented; on a line of its own if `what` is too long. What stands
/// in the last parentheses stays together.
std::string row(const std::string& what, std::string_view help, std::size_t width)
{
    std::string text = "  " + what;
    std::size_t column = text.size();
    const auto indent = [&] {
        text.append(left - column, ' ');
        column = left;
    };
    const auto newLine = [&] {
        text += '\n';
        column = 0;
        indent();
    };
    if (column + 2 > left)
        newLine();
    else
        indent();
    bool lineIsEmpty = true;
    while (!help.empty()) {
        const bool isTail = help.front() == '(' && help.find('(', 1) == std::string_view::npos && help.back() == ')';
        const std::size_t end = isTail ? help.size() : std::min(help.find(' '), help.size());
        if (!lineIsEmpty && column + 1 + end > width) newLine(), lineIsEmpty = true;
        if (!lineIsEmpty) text += ' ', ++column;
        text += help.substr(0, end);
        column += end;
        lineIsEmpty = false;
        help.remove_prefix(std::min(end + 1, help.size()));
    }
    return text + '\n';
}

std::string flagText(const CLI::Option& option)
{
    std::string text;
    for (const std::string& name : option.get_snames()) text += "-" + name + ", ";
    for (const std::string& name : option.get_lnames()) text += "--" + name + ", ";
    text.erase(text.size() - 2);
    if (option.get_items_expected_max() > 0) text += " " + option.get_type_name();
    return text;
}

class Pages : public CLI::Formatter {
    std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override
    {
        const bool isTop = app->get_parent() == nullptr;
        const std::string name = fullName(*app);
        const auto positionals = app->get_options([](const CLI::Option* o) { return o->get_positional(); });
        const auto commands = app->get_subcommands([](const CLI::App*) { return true; });
        const std::size_t width = pageWidth();

        std::string page = (isTop ? "" : name + ": ") + app->get_description() + "\n\nUsage: " + name;
        if (!commands.empty()) page += isTop ? " COMMAND" : " NAME";
        for (const CLI::Option* o : positionals) page += " " + o->get_name();
        for (const CLI::Option* o :
             app->get_options([](const CLI::Option* f) { return !f->get_positional() && f->get_required(); }))
            page += (o->get_snames().empty() ? " --" + o->get_lnames()[0] : " -" + o->get_snames()[0]) + " " +
                    o->get_type_name();
        page += " [flags]\n";

        if (!commands.empty() || !positionals.empty()) page += '\n';
        for (const CLI::App* command : commands) page += row(command->get_name(), command->get_description(), width);
        for (const CLI::Option* o : positionals) page += row(o->get_name(), o->get_description(), width);
        for (const std::string& group : app->get_groups()) {
            const auto options =
                app->get_options([&](const CLI::Option* o) { return !o->get_positional() && o->get_group() == group; });
            if (options.empty()) continue;
            page += "\n" + group + ":\n";
            for (const CLI::Option* o : options) page += row(flagText(*o), o->get_description(), width);
        }
        if (!app->get_footer().empty()) page += "\n" + app->get_footer() + "\n";
        return page;
    }
};

}  // namespace

void useHelpPages(CLI::App& app) { app.formatter(std::make_shared<Pages>()); }

}  // namespace virga::cli
