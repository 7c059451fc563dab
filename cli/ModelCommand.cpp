#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>

#include "Command.h"
#include "core/Error.h"
#include "io/AtomicFile.h"
#include "model/Model.h"

namespace virga::cli {
namespace {

struct ModelArguments {
    CommonFlags common;
    std::string plot;
};

std::string cell(const nlohmann::ordered_json& value)
{
    if (value.is_number_float()) return fmt::format("{:.10g}", value.get<double>());
    if (value.is_string()) return value.get<std::string>();
    if (!value.is_array()) return value.dump();
    std::string text;
    for (const auto& element : value) text += (text.empty() ? "" : "  ") + cell(element);
    return text;
}

/// Scalars first, one a line; then the lists, in columns.
std::string table(const Answer& answer)
{
    std::size_t widest = 0;
    for (const auto& [name, value] : answer.object.items())
        if (!value.is_array()) widest = std::max(widest, name.size());
    std::string text;
    for (const auto& [name, value] : answer.object.items())
        if (!value.is_array()) text += fmt::format("{:{}}  {}\n", name, widest, cell(value));
    for (const Columns& columns : answer.columns) {
        std::vector<std::vector<std::string>> column;
        const std::size_t rows = answer.object.at(columns.fields.front()).size();
        if (!columns.counter.empty()) {
            column.push_back({columns.counter});
            for (std::size_t i = 0; i < rows; ++i) column.back().push_back(std::to_string(columns.first + int(i)));
        }
        for (const std::string& name : columns.fields) {
            column.push_back({name});
            for (const auto& value : answer.object.at(name)) column.back().push_back(cell(value));
        }
        text += text.empty() ? "" : "\n";
        for (std::size_t row = 0; row <= rows; ++row) {
            std::string line;
            for (const auto& cells : column) {
                std::size_t width = 0;
                for (const std::string& c : cells) width = std::max(width, c.size());
                line += fmt::format("{}{:>{}}", line.empty() ? "" : "  ", cells[row], width);
            }
            text += line + "\n";
        }
    }
    return text;
}

void writePlot(const std::string& path, const std::vector<plot::Chart>& charts)
{
    if (!path.ends_with(".svg")) throw Error(ErrorCode::Output, "--plot '{}': charts are SVG, name a .svg file", path);
    io::writeWholeFile(path, plot::svg(charts));
}

int answer(const ModelArguments& arguments, const std::function<Answer()>& model)
{
    const Answer result = model();
    if (!arguments.plot.empty()) writePlot(arguments.plot, result.charts());
    if (arguments.common.json)
        std::printf("%s\n", result.object.dump(2).c_str());
    else if (arguments.plot.empty())
        std::fputs(table(result).c_str(), stdout);
    return 0;
}

/// `virga model` alone.
int list(const CommonFlags& common, const std::vector<Model>& models)
{
    if (common.json) {
        nlohmann::ordered_json object{{"models", nlohmann::json::array()}};
        for (const Model& m : models) object["models"].push_back(m.name);
        std::printf("%s\n", object.dump(2).c_str());
        return 0;
    }
    for (const Model& m : models) std::printf("%-12s%s\n", m.name, m.help);
    std::printf("'virga model NAME --help' has the flags of each.\n");
    return 0;
}

/// nullopt unless all of `text` is one finite number.
std::optional<double> numberFrom(std::string_view text)
{
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
    return value;
}

/// "0 to 90 deg", "over 1, at most 4".
std::string rangeText(const NumberRange& range)
{
    return fmt::format("{}{:g}{}{:g}{}{}", range.openLow ? "over " : "", range.low,
                       range.openLow ? ", at most " : " to ", range.high, *range.unit ? " " : "", range.unit);
}

bool isIn(double value, const NumberRange& range)
{
    return value <= range.high && (range.openLow ? value > range.low : value >= range.low);
}

/// "0.5,1,2", long lists as "0,5,...,90".
std::string listText(const std::vector<double>& values)
{
    if (values.size() > 12) return fmt::format("{:g},{:g},...,{:g}", values[0], values[1], values.back());
    return fmt::format("{:g}", fmt::join(values, ","));
}

}  // namespace

CLI::Option* addNumber(CLI::App& command, const std::string& flag, double& value, const NumberRange& range,
                       const std::string& help)
{
    return command
        .add_option_function<std::string>(
            flag, [&value](const std::string& text) { value = *numberFrom(text); },
            fmt::format("{} (default {:g}; {})", help, value, rangeText(range)))
        ->type_name(*range.unit ? range.unit : "N")
        ->check([range](const std::string& text) {
            const auto number = numberFrom(text);
            return number && isIn(*number, range) ? std::string()
                                                  : fmt::format("'{}': must be {}", text, rangeText(range));
        });
}

CLI::Option* addNumbers(CLI::App& command, const std::string& flag, std::vector<double>& values,
                        const NumberRange& range, const std::string& help)
{
    const auto parse = [range](const std::string& text, std::vector<double>& numbers) {
        for (std::size_t start = 0; start <= text.size();) {
            const std::size_t comma = std::min(text.find(',', start), text.size());
            const auto number = numberFrom(std::string_view(text).substr(start, comma - start));
            if (!number || !isIn(*number, range)) return false;
            numbers.push_back(*number);
            start = comma + 1;
        }
        return true;
    };
    return command
        .add_option_function<std::string>(
            flag,
            [&values, parse](const std::string& text) {
                values.clear();
                parse(text, values);
            },
            fmt::format("{} (default {}; {})", help, listText(values), rangeText(range)))
        ->type_name(std::string(range.unit) + ",...")
        ->check([range, parse](const std::string& text) {
            std::vector<double> numbers;
            return parse(text, numbers)
                       ? std::string()
                       : fmt::format("'{}': must be numbers separated by commas, each {}", text, rangeText(range));
        });
}

CLI::Option* addWhole(CLI::App& command, const std::string& flag, int& value, int low, int high,
                      const std::string& help, const std::string& word, int wordValue)
{
    const auto parse = [=](const std::string& text) -> std::optional<int> {
        if (!word.empty() && text == word) return wordValue;
        int number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc() || end != text.data() + text.size() || number < low || number > high) return {};
        return number;
    };
    const std::string allowed = fmt::format("{} to {}{}", low, high, word.empty() ? "" : " or " + word);
    return command
        .add_option_function<std::string>(
            flag, [&value, parse](const std::string& text) { value = *parse(text); },
            fmt::format("{} (default {}; {})", help, !word.empty() && value == wordValue ? word : std::to_string(value),
                        allowed))
        ->type_name(word.empty() ? "N" : "N|" + word)
        ->check([=](const std::string& text) {
            return parse(text) ? std::string() : fmt::format("'{}': must be a whole number, {}", text, allowed);
        });
}

std::vector<double> steps(double from, double to, int count)
{
    std::vector<double> values;
    values.reserve(std::size_t(count));
    for (int i = 0; i < count; ++i) values.push_back(from + (to - from) * i / (count - 1));
    return values;
}

std::vector<double> ratios(double from, double to, int count)
{
    std::vector<double> values;
    values.reserve(std::size_t(count));
    for (int i = 0; i < count; ++i) values.push_back(from * std::pow(to / from, double(i) / (count - 1)));
    return values;
}

Runner addModelCommand(CLI::App& app, CLI::App*& command)
{
    command = app.add_subcommand("model", "the numbers of one model as a table, JSON or charts");
    command->require_subcommand(0, 1);
    const auto arguments = std::make_shared<ModelArguments>();
    std::vector<Model> models;
    for (auto group : {opticsModels, rainModels, radianceModels})
        for (Model& m : group()) models.push_back(std::move(m));

    std::vector<std::pair<CLI::App*, std::function<Answer()>>> chosen;
    for (const Model& m : models) {
        CLI::App* const sub = command->add_subcommand(m.name, m.help);
        sub->footer(m.examples);
        chosen.emplace_back(sub, m.add(*sub));
        for (CLI::Option* option : sub->get_options()) option->group("Model");
        sub->add_option("--plot", arguments->plot, "draw charts instead of printing a table")
            ->type_name("SVG")
            ->group("In and out");
        addCommonFlags(*sub, arguments->common);
    }
    addCommonFlags(*command, arguments->common);
    return [arguments, chosen, models] {
        return runCommand(arguments->common, [&](const CommonFlags& common) {
            for (const auto& [sub, model] : chosen)
                if (sub->parsed()) return answer(*arguments, model);
            return list(common, models);
        });
    };
}

}  // namespace virga::cli
