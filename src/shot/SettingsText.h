// Settings as a document, in memory: what a settings file holds, and the same as JSON.
#pragma once

#include <string>

#include "shot/Settings.h"

namespace virga::shot {

/// Takes over what the document names: TOML as loadSettings reads it, or, if it begins with '{', a JSON object with the
/// same keys, at the top or in an object named after their group. All of it or, if it throws, none.
/// name  what sentences call it: "settings 'scene.toml'"
/// Throws Error(Input) if it is no document, with the line where there is one; Error(InvalidArgument) for a key or
/// value.
void applySettingsText(Settings& settings, const std::string& text, const std::string& name);

/// All settings, that applySettingsText reads back exactly: with their units and help as comments; or an object of one
/// object a group.
std::string settingsAsToml(const Settings& settings);
std::string settingsAsJson(const Settings& settings);

}  // namespace virga::shot
