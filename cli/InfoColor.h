// The parts of `virga info` that are about plates and colour.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace virga::cli {

/// What a plate's header says: size, frames, rate, format, colour space and why. Throws Error(Input).
nlohmann::json plateReport(const std::string& file, const std::string& ocio);
std::string plateText(const nlohmann::json& report);

/// Every colour space and role that --colorspace understands, and where the configuration comes from.
nlohmann::json colorReport(const std::string& ocio);
std::string colorText(const nlohmann::json& report);

}  // namespace virga::cli
