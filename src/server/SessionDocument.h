// What a client says to begin a session, and to change one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/FrameQuery.h"
#include "shot/Settings.h"

namespace virga::server {

/// Plates that the client sends itself.
struct PostedShot {
    int width = 0, height = 0;
};

struct SessionDocument {
    std::string platePath;  ///< as the client gave it; empty where it posts its plates
    std::optional<PostedShot> posted;
    shot::Settings settings;
};

/// A JSON object {"plate": PATH or {"width": W, "height": H}, "settings": {NAME: VALUE, ...}}, or, with `type`
/// application/toml, a settings file as `virga rain --settings` takes it, with ?plate=PATH, or ?width=W&height=H, in
/// the query. Posted plates light themselves (env-frames 0) unless the document says otherwise. Throws Refusal 400 or
/// 415, Error(InvalidArgument), Error(Input) for TOML that is none.
SessionDocument parseSessionDocument(std::string_view body, std::string_view type, const Query& query);

/// {NAME: VALUE, ...} onto `settings`, all of it or nothing. Throws as above.
void changeSettings(shot::Settings& settings, std::string_view json);

/// Sets parameters by name and text, as `virga rain --NAME TEXT`. Throws Error(InvalidArgument).
void changeSettings(shot::Settings& settings, const std::vector<std::pair<std::string, std::string>>& changes);

}  // namespace virga::server
