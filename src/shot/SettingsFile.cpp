#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "core/Words.h"
#include "io/AtomicFile.h"
#include "shot/Parameters.h"
#include "shot/SettingsText.h"

namespace virga::shot {
namespace {

nlohmann::json jsonFrom(const toml::node& node, std::string_view key)
{
    if (const auto* v = node.as_floating_point()) return v->get();
    if (const auto* v = node.as_integer()) return v->get();
    if (const auto* v = node.as_boolean()) return v->get();
    if (const auto* v = node.as_string()) return v->get();
    if (const auto* list = node.as_array()) {
        nlohmann::json values = nlohmann::json::array();
        for (const toml::node& item : *list) values.push_back(jsonFrom(item, key));
        return values;
    }
    throw Error(ErrorCode::InvalidArgument, "'{}' must be a number, a text, a list or a boolean", key);
}

void checkGroup(std::string_view name)
{
    std::vector<std::string> known;
    for (const Parameter& p : parameters())
        if (known.empty() || known.back() != p.group) known.emplace_back(p.group);
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    const std::string nearest = nearestWord(name, known);
    throw Error(ErrorCode::InvalidArgument, "no group of settings is called '{}'{}", name,
                nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest));
}

/// Of the key in a document's group, which is empty at the top.
const Parameter& parameterOf(std::string_view key, std::string_view group)
{
    const Parameter& p = findParameter(key);
    if (!group.empty() && group != p.group)
        throw Error(ErrorCode::InvalidArgument, "'{}' belongs into [{}], not [{}]", p.name, p.group, group);
    return p;
}

/// group: the table's name; empty at the top.
void apply(Settings& settings, const toml::table& table, std::string_view group, const std::string& name)
{
    for (const auto& [key, node] : table) {
        const auto* inner = node.as_table();
        try {
            if (inner != nullptr && group.empty())
                checkGroup(key.str());
            else
                setFromJson(settings, parameterOf(key.str(), group), jsonFrom(node, key.str()));
        } catch (const Error& error) {
            throw Error(error.code(), "{}, line {}: {}", name, node.source().begin.line, error.what());
        }
        if (inner != nullptr && group.empty()) apply(settings, *inner, key.str(), name);
    }
}

void apply(Settings& settings, const nlohmann::json& object, std::string_view group, const std::string& name)
{
    for (const auto& [key, value] : object.items()) {
        const bool isGroup = value.is_object() && group.empty();
        try {
            if (isGroup)
                checkGroup(key);
            else
                setFromJson(settings, parameterOf(key, group), value);
        } catch (const Error& error) {
            throw Error(error.code(), "{}: {}", name, error.what());
        }
        if (isGroup) apply(settings, value, key, name);
    }
}

void applyJson(Settings& settings, const std::string& text, const std::string& name)
{
    if (isNestedDeeper(text)) throw Error(ErrorCode::Input, "{}: is nested too deeply", name);
    nlohmann::json object;
    try {
        object = nlohmann::json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        const std::size_t line =
            1 + std::size_t(
                    std::count(text.begin(), text.begin() + std::ptrdiff_t(std::min(error.byte, text.size())), '\n'));
        throw Error(ErrorCode::Input, "{}, line {}: is no JSON", name, line);
    }
    apply(settings, object, "", name);
}

/// A TOML number keeps its kind: 25 would be read as an integer, which is fine, but inf and nan never occur.
std::string tomlValue(const nlohmann::json& value)
{
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void applySettingsText(Settings& settings, const std::string& text, const std::string& name)
{
    Settings changed = settings;
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first != std::string::npos && text[first] == '{') {
        applyJson(changed, text, name);
    } else {
        try {
            apply(changed, toml::parse(text), "", name);
        } catch (const toml::parse_error& error) {
            throw Error(ErrorCode::Input, "{}, line {}: {}", name, error.source().begin.line, error.description());
        }
    }
    settings = changed;
}

std::string settingsAsJson(const Settings& settings)
{
    nlohmann::ordered_json groups;
    for (const Parameter& p : parameters()) groups[p.group][p.name] = toJson(settings, p);
    return groups.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

void loadSettings(Settings& settings, const std::string& path)
{
    if (std::filesystem::is_directory(path)) throw Error(ErrorCode::Input, "settings '{}': is a folder", path);
    if (!std::filesystem::exists(path)) throw Error(ErrorCode::Input, "settings '{}': no such file", path);
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    if (!file) throw Error(ErrorCode::Input, "settings '{}': cannot be read", path);
    applySettingsText(settings, text, fmt::format("settings '{}'", path));
}

std::string settingsAsToml(const Settings& settings)
{
    std::string text = "# Settings of a shot: virga rain PLATE -o OUT --settings FILE\n";
    std::string_view group;
    for (const Parameter& p : parameters()) {
        if (group != p.group) {
            group = p.group;
            text += fmt::format("\n[{}]\n", group);
        }
        text += fmt::format("{} = {}  # {}{}{}\n", p.name, tomlValue(toJson(settings, p)), *p.unit ? p.unit : "",
                            *p.unit ? ": " : "", p.help);
    }
    return text;
}

void saveSettings(const Settings& settings, const std::string& path)
{
    io::writeWholeFile(path, settingsAsToml(settings));
}

}  // namespace virga::shot
