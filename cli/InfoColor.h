// The part of `virga info` that is about colour spaces.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace virga::cli {

/// Every colour space and role that --colorspace understands, and where the configuration comes from.
nlohmann::json colorReport(const std::string& ocio);
std::string colorText(const nlohmann::json& report);

}  // namespace virga::cli
