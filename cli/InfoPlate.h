// What `virga info PLATE` says.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace virga::cli {

/// What a plate's header says: size, frames, rate, format, colour and why, what else is in it. stream: which of a
/// movie's video streams. Throws Error(Input), and Error(InvalidArgument) for a stream that is not there.
nlohmann::json plateReport(const std::string& file, const std::string& ocio, std::optional<int> stream);
std::string plateText(const nlohmann::json& report);

}  // namespace virga::cli
