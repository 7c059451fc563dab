#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/Error.h"
#include "core/Words.h"
#include "shot/Parameters.h"

namespace virga::shot {
namespace {

constexpr std::string_view reportFormat = "virga-extract-report";
constexpr int reportVersion = 1;

/// A value on one line of a sentence, whatever bytes the file holds.
std::string textOf(const nlohmann::json& value)
{
    return shortened(value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

nlohmann::json readReport(const std::string& path)
{
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) throw Error(ErrorCode::Input, "match '{}': is a folder", path);
    if (!std::filesystem::exists(path, ignored)) throw Error(ErrorCode::Input, "match '{}': no such file", path);
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(ErrorCode::Input, "match '{}': cannot be read", path);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const nlohmann::json report = isNestedDeeper(text) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                                       : nlohmann::json::parse(text, nullptr, false);
    if (report.is_discarded()) throw Error(ErrorCode::Input, "match '{}': is not JSON", path);
    if (!report.is_object() || report.value("format", nlohmann::json()) != reportFormat)
        throw Error(ErrorCode::Input, "match '{}': is no report of virga extract (\"format\" must be \"{}\")", path,
                    reportFormat);
    const nlohmann::json version = report.value("version", nlohmann::json());
    if (version != reportVersion)
        throw Error(ErrorCode::Input, "match '{}': is a report of version {}; this program reads version {}", path,
                    version.is_null() ? "unknown" : textOf(version), reportVersion);
    return report;
}

}  // namespace

void loadMatch(Settings& settings, const std::string& path)
{
    const nlohmann::json report = readReport(path);
    const auto match = report.find("match");
    if (match == report.end() || match->is_null())
        throw Error(ErrorCode::Input, "match '{}': virga extract found no rain in that footage, nothing to match",
                    path);
    if (!match->is_object())
        throw Error(ErrorCode::Input, "match '{}': \"match\" is {}: must be an object of settings", path,
                    textOf(*match));
    Settings matched = settings;
    for (const auto& [key, value] : match->items()) {
        try {
            setFromJson(matched, findParameter(key), value);
        } catch (const Error& error) {
            throw Error(error.code(), "match '{}': {}", path, error.what());
        }
    }
    // What is asked in another way would outrank what the report says.
    if (match->contains("rate") && !match->contains("strokes")) matched.strokes.reset();
    if (match->contains("shutter") && !match->contains("exposure")) matched.exposure_s.reset();
    // Only what the report itself named; an absolute path stays as it is.
    if (match->contains("mattes") && !matched.mattes.empty())
        matched.mattes = (std::filesystem::path(path).parent_path() / matched.mattes).string();
    settings = matched;
}

}  // namespace virga::shot
