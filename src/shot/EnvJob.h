// `virga env`, whole: a panorama or footage in; a checked, repaired, filled panorama out, with a picture and a report
// of what drops make of it.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "shot/RainJob.h"

namespace virga::shot {

enum class EnvMode {
    Auto,
    Panorama,  ///< one picture of all directions
    Static,    ///< footage of a camera that stands still: a few frames, one view
    Pan,       ///< footage of a camera that turns: frames joined
    Loom,      ///< footage of a camera that travels: a panorama every few frames, each from its own
};
/// "auto, panorama, static, pan or loom"; nothing for any other word.
std::optional<EnvMode> envModeNamed(const std::string& name);
const char* nameOf(EnvMode mode);

struct EnvJobOptions {
    std::string input, output;
    std::string frames;  ///< frame range; empty: all
    EnvMode mode = EnvMode::Auto;
    std::string layout = "auto";          ///< of a panorama; environment/PanoramaLayout.h has the names
    std::string colorspace;               ///< of the input; empty: from metadata, file rules, else guess
    std::string ocio;                     ///< OpenColorIO configuration; empty: $OCIO's, else the built-in one
    std::optional<double> fov_deg;        ///< of footage; empty: estimated where the camera turns, else 60
    double yaw_deg = 0;                   ///< to the right: what is ahead goes there
    double pitch_deg = 0;                 ///< up
    double roll_deg = 0;                  ///< clockwise, as seen from inside
    std::optional<double> lightRadiance;  ///< of lights that are cut off at white, in linear units of the input
    std::optional<double> sky;            ///< radiance of the sky that footage does not show
    int width = 2048;                     ///< of panoramas made from footage
    std::optional<int> every;             ///< Loom: frames from one panorama to the next
    int order = 3;                        ///< of the coefficients in the report
    bool half = false;                    ///< EXR as 16-bit half
    std::string preview;                  ///< PNG; empty: OUT_preview.png beside the output; "none": none
    std::string track;                    ///< .chan of a turning camera; empty: none
};

/// Writes the panorama and the preview, and gives the object that `virga env --json` prints (docs/env.md).
/// Warnings go to the log. progress: as in runRainJob(), a call a frame; Stop ends after it.
/// Throws Error; nothing half-written is left under the output's name.
nlohmann::json runEnvJob(const EnvJobOptions& options, const std::function<Verdict(const Progress&)>& progress);

}  // namespace virga::shot
