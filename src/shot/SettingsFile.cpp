#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/Error.h"
#include "core/Words.h"
#include "io/AtomicFile.h"
#include "shot/Parameters.h"

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

/// group: the table's name; empty at the top.
void apply(Settings& settings, const toml::table& table, std::string_view group, const std::string& path)
{
    for (const auto& [key, node] : table) {
        const auto* inner = node.as_table();
        try {
            if (inner != nullptr && group.empty()) {
                checkGroup(key.str());
            } else {
                const Parameter& p = findParameter(key.str());
                if (!group.empty() && group != p.group)
                    throw Error(ErrorCode::InvalidArgument, "'{}' belongs into [{}], not [{}]", p.name, p.group, group);
                setFromJson(settings, p, jsonFrom(node, key.str()));
            }
        } catch (const Error& error) {
            throw Error(error.code(), "settings '{}', line {}: {}", path, node.source().begin.line, error.what());
        }
        if (inner != nullptr) apply(settings, *inner, key.str(), path);
    }
}

/// A TOML number keeps its kind: 25 would be read as an integer, which is fine, but inf and nan never occur.
std::string tomlValue(const nlohmann::json& value)
{
    return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void loadSettings(Settings& settings, const std::string& path)
{
    if (std::filesystem::is_directory(path)) throw Error(ErrorCode::Input, "settings '{}': is a folder", path);
    if (!std::filesystem::exists(path)) throw Error(ErrorCode::Input, "settings '{}': no such file", path);
    try {
        apply(settings, toml::parse_file(path), "", path);
    } catch (const toml::parse_error& error) {
        throw Error(ErrorCode::Input, "settings '{}', line {}: {}", path, error.source().begin.line,
                    error.description());
    }
}

void saveSettings(const Settings& settings, const std::string& path)
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
    io::writeWholeFile(path, text);
}

}  // namespace virga::shot
