// `virga extract`, whole: footage of rain in; its mattes, the scene behind it, the footage without it, an atlas of its
// strokes and what they say of the rain out. docs/extract.md.
#pragma once

#include <array>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "shot/RainJob.h"

namespace virga::shot {

struct ExtractJobOptions {
    std::string footage;
    std::string output;   ///< a folder; made if it is not there
    std::string frames;   ///< frame range; empty: all
    int stack = 0;        ///< the footage is one image of so many frames, top to bottom
    bool linear = false;  ///< its values are linear light as they stand, and the model holds in them
    std::string colorspace;
    std::string ocio;
    std::optional<double> fps;
    std::optional<int> stream;  ///< of a movie, which of its video streams; nothing: the default one
    std::string layer, view;    ///< of an EXR
    bool deinterlace = false;
    std::string onError = "stop";  ///< stop, skip, hold

    bool paper = false;                          ///< Wang et al. 2006 as it is written
    std::string space = "auto";                  ///< auto, linear, display
    std::optional<std::array<double, 3>> color;  ///< C, scene-linear
    std::optional<double> slant_deg;             ///< from vertical, the lower end to the right
    std::optional<double> lambda, mu;
    std::optional<int> iterations;  ///< 3; paper: 20
    double tolerance = 1e-4;
    int window = 20;         ///< frames that are solved together
    bool movers = true;      ///< tell what moves from rain
    bool stabilize = false;  ///< register the frames first
    bool force = false;      ///< go on where the static model does not hold

    int strokes = 64;  ///< of the atlas
    int tileWidth = 16, tileHeight = 64;
    std::optional<double> exposure_s;  ///< of the footage, if it is known
    double fov_deg = 60;               ///< of the footage

    std::string clean = "clean.####.exr";  ///< the footage without rain: a pattern or a movie in `output`; none
    bool confidence = false;               ///< write how much each alpha rests on data
    bool half = false, floats = false;     ///< EXR as half or float; neither: float if the footage has over 10 bits
};

/// Runs the job; returns what report.json holds. progress is called after each frame that was delivered, on this
/// thread; Stop ends the job after it, with what is written whole. Throws Error; a folder that was made and is empty is
/// taken away again.
nlohmann::json runExtractJob(const ExtractJobOptions& options, const std::function<Verdict(const Progress&)>& progress);

}  // namespace virga::shot
