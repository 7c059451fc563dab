#include <cmath>
#include <cstdint>

#include "fuzz/Targets.h"
#include "shot/DepthSource.h"
#include "shot/LightsFile.h"
#include "shot/Parameters.h"

namespace virga::fuzz {

namespace {

constexpr auto settingCodes = {ErrorCode::InvalidArgument, ErrorCode::Input};

/// Each number lies within its range, and what is written of each is read back.
void requireGood(const shot::Settings& settings)
{
    shot::Settings again;
    for (const shot::Parameter& parameter : shot::parameters()) {
        const std::string text = shot::toText(settings, parameter);
        shot::setFromText(again, parameter, text);
        require(shot::toText(again, parameter) == text, "a setting that was taken is written and read back");
    }
}

/// The first byte chooses the setting, the rest is what is typed for it.
void takeParameter(std::string_view input)
{
    if (input.empty()) return;
    const auto table = shot::parameters();
    const shot::Parameter& parameter = table[std::uint8_t(input[0]) % table.size()];
    shot::Settings settings;
    if (!isOneLine(input.substr(1))) return;  // what is typed is repeated as it was typed
    if (answers({ErrorCode::InvalidArgument},
                [&] { shot::setFromText(settings, parameter, std::string(input.substr(1))); }))
        requireGood(settings);
}

void takeSettings(std::string_view input)
{
    shot::Settings settings;
    const std::string path = fileOf(input);
    if (answers(settingCodes, [&] { shot::loadSettings(settings, path); })) requireGood(settings);
}

void takeMatch(std::string_view input)
{
    shot::Settings settings;
    const std::string path = fileOf(input);
    if (answers(settingCodes, [&] { shot::loadMatch(settings, path); })) requireGood(settings);
}

void takeLights(std::string_view input)
{
    const std::string path = fileOf(input);
    answers({ErrorCode::Input}, [&] {
        const std::vector<shot::SceneLight> lights = shot::readLights(path);
        require(lights.size() <= shot::maxSceneLights, "no more lights than a frame takes");
        for (const shot::SceneLight& light : lights) {
            require(light.radius_m >= 0.001 && light.radius_m <= 100, "a lamp has a size");
            for (int i = 0; i < 3; ++i)
                require(
                    std::isfinite(light.position[i]) && light.intensity[i] >= 0 && std::isfinite(light.intensity[i]),
                    "a lamp is somewhere and shines");
        }
    });
}

void takeGround(std::string_view input)
{
    if (!isOneLine(input)) return;  // what is typed is repeated as it was typed
    answers({ErrorCode::InvalidArgument}, [&] {
        const shot::Ground ground = shot::parseGround(std::string(input));
        require(ground.height_m > 0 && ground.height_m <= 1e4, "the camera is over the ground");
        require(std::abs(ground.pitch_deg) < 90, "the pitch is an angle");
    });
}

}  // namespace

std::vector<Target> shotTargets()
{
    std::vector<std::string> values;
    const auto table = shot::parameters();
    for (std::size_t i = 0; i < table.size(); ++i) values.push_back(char(i) + shot::toText(shot::Settings(), table[i]));
    return {
        {"parameter", takeParameter, values, {"auto", "true", "nan", "inf", "1e308", "-", ",", "0x1p3"}},
        {"settings",
         takeSettings,
         {"rate = 25\n[rain]\nwind = [1.5, -2]\nseed = 7\n[camera]\nfov = \"auto\"\nshutter = 180\n[scene]\n"
          "depth-invert = false\nfog-color = [0.1, 0.2, 0.3]\n[file]\non-error = \"skip\"\n",
          "[light]\nlight-radiance = inf\nenv = '''a\nb'''\npaper = true # note\n"},
         {"rate", "wind", "[rain]", "[[rain]]", "nan", "inf", "\"auto\"", "{a = 1}", "1979-05-27", "'''", "\\u0000"}},
        {"match",
         takeMatch,
         {R"({"format": "virga-extract-report", "version": 1, "match": {"rate": 12.5, "exposure": 0.01,
              "wind": [1, -2], "opacity": 3, "mattes": "atlas.exr"}})",
          R"({"format": "virga-extract-report", "version": 1, "match": null})"},
         {"rate", "shutter", "strokes", "wind", "null", "[", "{", "1e400", "\"auto\"", "\\ud800"}},
        {"lights",
         takeLights,
         {"[[light]]\nname = \"lamp\"\nposition = [-3.25, 4.4, -12.5]\nradiance = [9.0, 5.94, 2.7]\nradius_m = 0.16\n"
          "[[light]]\nposition = [0, 0, 1]\nintensity = [1, 2, 3]\n"},
         {"[[light]]", "position", "radiance", "intensity", "radius_m", "nan", "inf", "1e400", "light = [{}]"}},
        {"ground", takeGround, {"1.5", "1.5,4", "10000,-89.9"}, {"nan", "inf", ",", "-", "1e308"}}};
}

}  // namespace virga::fuzz
