// How much of the stress suite is run, and on what: the environment says (scripts/stress.sh).
#pragma once

#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

#include "gl/Context.h"

namespace virga::stress {

inline std::uint32_t fromEnvironment(const char* name, std::uint32_t standard)
{
    const char* text = std::getenv(name);
    return text == nullptr || *text == 0 ? standard : std::uint32_t(std::strtoul(text, nullptr, 10));
}

/// VIRGA_STRESS_LONG: what takes minutes and gigabytes too.
inline bool isLong() { return fromEnvironment("VIRGA_STRESS_LONG", 0) != 0; }

/// The OpenGL device that shaders are stressed on: VIRGA_STRESS_DEVICE, else the first there is. Nothing: there is
/// none.
inline std::optional<std::string> shaderDevice()
{
    if (const char* name = std::getenv("VIRGA_STRESS_DEVICE"); name != nullptr && *name != 0) return name;
    const auto devices = gl::listDevices();
    if (devices.empty()) return std::nullopt;
    return std::to_string(devices.front().index);
}

}  // namespace virga::stress
