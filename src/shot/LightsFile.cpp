#include "shot/LightsFile.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>

#include "core/Error.h"
#include "core/Words.h"
#include "shot/Parameters.h"

namespace virga::shot {
namespace {

/// What a list of numbers may hold.
struct Range {
    double least, most;
    const char* allowed;
};
constexpr Range anywhere{-1e6, 1e6, "-1000000 to 1000000 m"};
constexpr Range light{0.0, 1e9, "0 to 1000000000"};
constexpr Range size{0.001, 100.0, "0.001 to 100 m"};

/// The value on one line, as it stands in the file.
std::string valueText(const toml::node& node)
{
    if (node.is_table()) return "a table";
    if (const toml::array* list = node.as_array()) {
        std::string text;
        for (const toml::node& item : *list) text += (text.empty() ? "" : ", ") + valueText(item);
        return "[" + text + "]";
    }
    std::ostringstream text;
    node.visit([&](const auto& value) { text << value; });
    return text.str();
}

class LightReader {
public:
    explicit LightReader(std::string path) : path_(std::move(path)) {}

    std::vector<SceneLight> read() const
    {
        if (!std::filesystem::is_regular_file(path_)) throw Error(ErrorCode::Input, "lights '{}': no such file", path_);
        toml::table root;
        try {
            root = toml::parse_file(path_);
        } catch (const toml::parse_error& error) {
            throw Error(ErrorCode::Input, "lights '{}', line {}: {}", path_, error.source().begin.line,
                        error.description());
        }
        static const std::array<std::string, 1> known{"light"};
        checkKeys(root, known);
        const toml::node* node = root.get("light");
        if (!node) return {};
        const toml::array* list = node->as_array();
        if (!list || (!list->empty() && !list->is_homogeneous<toml::table>()))
            fail(*node, "'light' = {}: must be tables: write [[light]] over each", valueText(*node));
        if (list->size() > maxSceneLights)
            fail(*list->get(maxSceneLights), "{} [[light]]s: at most {} are allowed", list->size(), maxSceneLights);
        std::vector<SceneLight> lights;
        for (const toml::node& entry : *list) lights.push_back(lightFrom(*entry.as_table()));
        return lights;
    }

private:
    SceneLight lightFrom(const toml::table& table) const
    {
        static const std::array<std::string, 5> known{"name", "position", "intensity", "radiance", "radius_m"};
        checkKeys(table, known);
        SceneLight result{};
        if (const toml::node* node = table.get("name")) {
            if (!node->is_string()) fail(*node, "'name' = {}: must be a text", valueText(*node));
            result.name = node->as_string()->get();
        }
        const auto position = vector(table, "position", anywhere);
        if (!position) fail(table, "a [[light]] without 'position': must be [x, y, z] in metres");
        result.position = *position;

        const auto intensity = vector(table, "intensity", light), radiance = vector(table, "radiance", light);
        const auto radius = number(table, "radius_m", size);
        if (intensity && radiance) fail(*table.get("radiance"), "'radiance' and 'intensity': must be one of the two");
        if (!intensity && !radiance)
            fail(table, "a [[light]] without 'intensity': must be [r, g, b], or 'radiance' with 'radius_m'");
        if (radiance && !radius)
            fail(*table.get("radiance"), "'radiance' without 'radius_m': must be given, {}", size.allowed);
        result.radius_m = radius.value_or(0.05);
        result.intensity = intensity ? *intensity : std::numbers::pi * *radius * *radius * *radiance;
        return result;
    }

    void checkKeys(const toml::table& table, std::span<const std::string> known) const
    {
        for (const auto& [key, node] : table) {
            if (std::ranges::find(known, key.str()) != known.end()) continue;
            const std::string nearest = nearestWord(key.str(), known);
            std::string names;
            for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
            throw Error(ErrorCode::Input, "lights '{}', line {}: no key is called '{}'; {}", path_,
                        key.source().begin.line, key.str(),
                        nearest.empty() ? "must be one of " + names : "did you mean '" + nearest + "'?");
        }
    }

    /// A finite number within `range`; empty if the node is none.
    static std::optional<double> numberFrom(const toml::node& node, const Range& range)
    {
        std::optional<double> value;
        if (const auto* v = node.as_floating_point()) value = v->get();
        if (const auto* v = node.as_integer()) value = double(v->get());
        if (value && !(*value >= range.least && *value <= range.most)) value.reset();
        return value;
    }

    std::optional<double> number(const toml::table& table, const char* key, const Range& range) const
    {
        const toml::node* node = table.get(key);
        if (!node) return std::nullopt;
        const auto value = numberFrom(*node, range);
        if (!value) fail(*node, "'{}' = {}: must be a number, {}", key, valueText(*node), range.allowed);
        return value;
    }

    std::optional<glm::dvec3> vector(const toml::table& table, const char* key, const Range& range) const
    {
        const toml::node* node = table.get(key);
        if (!node) return std::nullopt;
        glm::dvec3 result(0.0);
        const toml::array* list = node->as_array();
        bool good = list && list->size() == 3;
        for (int i = 0; good && i < 3; ++i) {
            const auto value = numberFrom(*list->get(std::size_t(i)), range);
            good = value.has_value();
            if (good) result[i] = *value;
        }
        if (!good)
            fail(*node, "'{}' = {}: must be a list of three numbers, each {}", key, valueText(*node), range.allowed);
        return result;
    }

    template <class... Args>
    [[noreturn]] void fail(const toml::node& where, fmt::format_string<Args...> format, Args&&... args) const
    {
        throw Error(ErrorCode::Input, "lights '{}', line {}: {}", path_, where.source().begin.line,
                    fmt::format(format, std::forward<Args>(args)...));
    }

    std::string path_;
};

}  // namespace

std::vector<SceneLight> readLights(const std::string& path) { return LightReader(path).read(); }

}  // namespace virga::shot
