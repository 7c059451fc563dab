// The one table of settings (docs/design.md, "One parameter table"): flags, TOML keys, JSON, plug-in parameters and
// docs/parameters.md are made from it. Adding a parameter is adding a row.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "shot/Settings.h"

namespace virga::shot {

struct Parameter {
    const char* name;    ///< as in --name, and the TOML and JSON key
    const char* group;   ///< "rain", "camera", "light", "scene", "grade", "file"
    const char* unit;    ///< "mm/h"; "x" is a plain multiplier; empty for text and switches
    double least, most;  ///< of each number; text and switches ignore them
    const char* help;    ///< one line
    std::variant<double Settings::*, AutoNumber Settings::*, std::int64_t Settings::*, bool Settings::*,
                 std::string Settings::*, std::array<double, 2> Settings::*, AutoColor Settings::*>
        member;
    const char* choices = nullptr;  ///< for text: the words allowed, separated by '|'
    /// What the default is off by, and the command that measures it (docs/benchmarks.md); nothing where it trades no
    /// error for time.
    const char* error = nullptr;

    bool isSwitch() const { return std::holds_alternative<bool Settings::*>(member); }
};

/// All parameters, in the order of the help.
std::span<const Parameter> parameters();

/// The parameter of that name. Throws Error(InvalidArgument) naming it and the nearest known name.
const Parameter& findParameter(std::string_view name);

/// Sets one value from text as a user types it ("25", "auto", "1.5,-2", "true").
/// Throws Error(InvalidArgument) naming the parameter, the text and what is allowed.
void setFromText(Settings& settings, const Parameter& parameter, const std::string& text);
/// The text that setFromText reads back to the same value.
std::string toText(const Settings& settings, const Parameter& parameter);

/// As above for JSON values (numbers, strings, booleans, lists).
void setFromJson(Settings& settings, const Parameter& parameter, const nlohmann::json& value);
nlohmann::json toJson(const Settings& settings, const Parameter& parameter);

/// Reads a TOML file: keys are parameter names, at the top or in a table named after their group.
/// Throws Error(Input) if it cannot be read or parsed (with the line), Error(InvalidArgument) for a key or value.
void loadSettings(Settings& settings, const std::string& path);
/// Takes over what `virga extract` says of the rain in other footage: the keys of "match" in the report.json that it
/// writes, parameter names like a settings file's. A relative "mattes" counts from the report's own folder. A
/// "rate" undoes `strokes`, a "shutter" undoes `exposure`, which would outrank them. A report that is refused changes
/// nothing.
/// Throws Error(Input) if it cannot be read, is no such report or of another version, or if no rain was found in that
/// footage; Error(InvalidArgument) for a key or value. The sentence names the file.
void loadMatch(Settings& settings, const std::string& path);
/// Writes all parameters with their units and help as comments; loadSettings reads them back exactly. Throws
/// Error(Output).
void saveSettings(const Settings& settings, const std::string& path);

/// What a parameter allows, without its unit: "0 to 2000"; for text "stop, skip or hold"; empty if anything goes.
std::string rangeText(const Parameter& parameter);

/// docs/parameters.md, whole.
std::string parametersPage();

}  // namespace virga::shot
