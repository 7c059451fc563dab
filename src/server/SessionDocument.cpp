#include "server/SessionDocument.h"

#include <nlohmann/json.hpp>

#include "core/Words.h"
#include "server/Refusal.h"
#include "shot/Parameters.h"
#include "shot/SettingsText.h"

namespace virga::server {
namespace {

using nlohmann::json;
constexpr int mostSide = 16384;  // what OpenGL 4.5 promises for textures

json objectFrom(std::string_view text)
{
    if (isNestedDeeper(text)) throw Refusal(400, "bad-json", "the document is nested too deeply");
    json document = json::parse(text, nullptr, false);
    if (document.is_discarded() || !document.is_object())
        throw Refusal(400, "bad-json", "the document is no JSON object");
    return document;
}

void setAll(shot::Settings& settings, const json& values)
{
    if (!values.is_object()) throw Refusal(400, "invalid-argument", "settings must be an object of names and values");
    shot::Settings changed = settings;
    for (const auto& [name, value] : values.items())
        shot::setFromJson(changed, shot::findParameter(shortened(name)), value);
    settings = changed;
}

int sideFrom(const char* name, const json& value)
{
    if (!value.is_number_integer() || value < 1 || value > mostSide)
        throw Refusal(400, "invalid-argument", "{} '{}': must be a whole number, 1 to {}", name,
                      shortened(value.dump(-1, ' ', false, json::error_handler_t::replace)), mostSide);
    return value.get<int>();
}

PostedShot postedFrom(const json& plate)
{
    for (const auto& [name, value] : plate.items())
        if (name != "width" && name != "height")
            throw Refusal(400, "invalid-argument", "a plate has no '{}'; it is a path, or width and height",
                          shortened(name));
    return {sideFrom("width", plate.value("width", json())), sideFrom("height", plate.value("height", json()))};
}

void lightByThemselves(shot::Settings& settings) { settings.envFrames = 0; }

SessionDocument fromToml(std::string_view body, const Query& query)
{
    SessionDocument document;
    json plate = json::object();
    for (const auto& [name, value] : query) {
        if (name == "plate")
            document.platePath = value;
        else if (name == "width" || name == "height")
            plate[name] = json::parse(value, nullptr, false);
        else
            throw Refusal(400, "invalid-argument", "'{}' is not plate, width or height", shortened(name));
    }
    if (!plate.empty()) {
        document.posted = postedFrom(plate);
        lightByThemselves(document.settings);
    }
    shot::applySettingsText(document.settings, std::string(body), "document");
    return document;
}

SessionDocument fromJson(std::string_view body)
{
    SessionDocument document;
    const json object = objectFrom(body);
    for (const auto& [name, value] : object.items()) {
        if (name == "plate" && value.is_string())
            document.platePath = value.get<std::string>();
        else if (name == "plate" && value.is_object())
            document.posted = postedFrom(value);
        else if (name == "plate")
            throw Refusal(400, "invalid-argument", "plate must be a path, or an object with width and height");
        else if (name != "settings")
            throw Refusal(400, "invalid-argument", "a session has no '{}'; there are plate and settings",
                          shortened(name));
    }
    if (document.posted) lightByThemselves(document.settings);
    if (object.contains("settings")) setAll(document.settings, object["settings"]);
    return document;
}

}  // namespace

SessionDocument parseSessionDocument(std::string_view body, std::string_view type, const Query& query)
{
    const std::string_view kind = type.substr(0, type.find(';'));
    if (kind != "application/toml" && kind != "application/json" && !kind.empty())
        throw Refusal(415, "content-type", "'{}': a session is application/json or application/toml", shortened(kind));
    SessionDocument document = kind == "application/toml" ? fromToml(body, query) : fromJson(body);
    if (document.platePath.empty() != document.posted.has_value())
        throw Refusal(400, "invalid-argument", "a session needs a plate: a path below the root, or width and height");
    return document;
}

void changeSettings(shot::Settings& settings, std::string_view text) { setAll(settings, objectFrom(text)); }

void changeSettings(shot::Settings& settings, const std::vector<std::pair<std::string, std::string>>& changes)
{
    for (const auto& [name, value] : changes) shot::setFromText(settings, shot::findParameter(shortened(name)), value);
}

}  // namespace virga::server
