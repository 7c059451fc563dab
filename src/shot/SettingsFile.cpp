#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "core/Error.h"
#include "shot/Parameters.h"

namespace virga::shot {
namespace {

nlohmann::json jsonFrom(const toml::node& node, const std::string& path, std::string_view key)
{
    if (const auto* v = node.as_floating_point()) return v->get();
    if (const auto* v = node.as_integer()) return v->get();
    if (const auto* v = node.as_boolean()) return v->get();
    if (const auto* v = node.as_string()) return v->get();
    if (const auto* list = node.as_array()) {
        nlohmann::json values = nlohmann::json::array();
        for (const toml::node& item : *list) values.push_back(jsonFrom(item, path, key));
        return values;
    }
    throw Error(ErrorCode::InvalidArgument, "settings '{}', line {}: '{}' must be a number, a text, a list or a boolean",
                path, node.source().begin.line, key);
}

void apply(Settings& settings, const toml::table& table, const std::string& path)
{
    for (const auto& [key, node] : table) {
        if (const auto* group = node.as_table()) {
            apply(settings, *group, path);
            continue;
        }
        try {
            setFromJson(settings, findParameter(key.str()), jsonFrom(node, path, key.str()));
        } catch (const Error& error) {
            throw Error(error.code(), "settings '{}', line {}: {}", path, node.source().begin.line, error.what());
        }
    }
}

/// A TOML number keeps its kind: 25 would be read as an integer, which is fine, but inf and nan never occur.
std::string tomlValue(const nlohmann::json& value) { return value.dump(); }

}  // namespace

void loadSettings(Settings& settings, const std::string& path)
{
    if (!std::filesystem::is_regular_file(path))
        throw Error(ErrorCode::Input, "settings '{}': no such file", path);
    try {
        apply(settings, toml::parse_file(path), path);
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
    const std::string partial = path + ".partial";
    std::ofstream file(partial);
    file << text;
    file.close();
    std::error_code failure;
    if (file) std::filesystem::rename(partial, path, failure);
    if (!file || failure) {
        std::filesystem::remove(partial, failure);
        throw Error(ErrorCode::Output, "settings cannot be written to '{}'", path);
    }
}

}  // namespace virga::shot
