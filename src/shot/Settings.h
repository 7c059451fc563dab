// Everything that shapes a shot's rain, in the units that artists type. The one table of them is in Parameters.h.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace virga::shot {

/// A number that may be left to the program.
using AutoNumber = std::optional<double>;
/// Linear RGB that may be left to the program.
using AutoColor = std::optional<std::array<double, 3>>;

/// Defaults are the table's; docs/parameters.md says what each does.
struct Settings {
    // rain
    double rate_mm_h = 25;
    AutoNumber strokes;
    double dropSize = 1;
    double speed = 1;
    std::array<double, 2> wind_m_s{0, 0};
    double gust_m_s = 0.3;
    double turbulence_m_s = 0.25;
    double opacity = 5;
    double near_m = 0.8;
    double far_m = 200;
    double threshold = 0.02;
    double thin = 0.08;
    std::int64_t seed = 1;
    std::string mattes;
    // camera
    AutoNumber shutter_deg;
    AutoNumber exposure_s;
    AutoNumber fov_deg;
    double focus_m = 5;
    double fstop = 8;
    double sensorWidth_mm = 24.9;
    std::string camera;
    double cameraScale = 1;
    std::string cameraUp = "y";
    std::string cameraOrder = "zxy";
    std::string cameraLayout = "row";
    std::string cameraMatrix = "camera-to-world";
    std::string cameraAxes = "opengl";
    std::int64_t cameraOffset = 0;
    AutoNumber fps;
    AutoNumber firstFrame;  ///< whole
    // light
    std::string env;
    double envYaw_deg = 0;
    double envPitch_deg = 0;
    double envGain = 1;
    AutoNumber envOrder;
    std::int64_t envFrames = 5;
    AutoNumber lightRadiance;
    AutoNumber sky;
    std::string lights;
    double backgroundBoost = 0;
    bool paper = false;
    // scene
    std::string depth;
    double depthScale = 1;
    bool depthInvert = false;
    std::string depthKind = "z";
    double depthOffset = 0;
    std::array<double, 2> depthRange{};
    double depthBaseline_m = 0;
    std::string depthChannel;
    std::string depthPacking = "none";
    AutoNumber depthFirstFrame;  ///< whole
    AutoNumber depthNoValue;
    std::string ground;
    AutoNumber fog_1_m;
    AutoColor fogColor;
    double fogDistance_m = 50;
    double blur_px = 0;
    double blurDistance_m = 50;
    double splashes = 1;
    double splashSize = 1;
    // grade
    double darken = 0.1;
    double desaturate = 0.1;
    std::string gradeFrom;
    double gradeAmount = 1;
    // input and output
    std::string colorspace;
    std::string outputColorspace;
    std::string ocio;
    bool floatOutput = false;
    std::string codec;
    AutoNumber quality;
    std::string pixelFormat, profile, preset, codecOptions, container;
    bool reencode = false;
    std::string layer, view;
    AutoNumber stream;  ///< whole
    bool deinterlace = false;
    std::string onError = "stop";
};

}  // namespace virga::shot
