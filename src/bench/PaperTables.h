// `virga bench tables`: the frame rates that papers on rain print, measured anew on this machine with this renderer,
// the papers' own figures beside. What is the same is how many drops or strokes are drawn at which size; the light, the
// mattes and the machines are not.
//
//   wang      Wang, Lin, Fang, Xu, Yang, Kang & Quan 2006, Table 3: strokes against frame rate, all of them visible,
//   lit by
//             the environment. Pentium 4 at 3.2 GHz, GeForce 7800 GT.
//   nvidia    Tariq 2007, "Rain", Tables 1 and 2: animating particles, and extruding and rasterising them, at 1280 x
//             1024, 45 degrees, "simple shader". Core 2 at 2.93 GHz, GeForce 8800 GTX. Here animation is listing the
//             cells and placing each drop, and all particles are in view; in the paper they are all around the camera.
//   rousseau  Rousseau, Jolivet & Ghazanfarpour 2006, Tables 4 and 5: drops, and streaks of five sample positions, of
//   one
//             radius, with and without the light of lamps. Athlon 3200+, GeForce 7800 GT.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace virga::bench {

/// What of a frame a table times.
enum class Timed { Frame, Animation, Drawing };

struct PaperCase {
    std::string paper, table;  ///< "wang", "Table 3"
    std::string what;          ///< "80,000 strokes"
    int width, height;
    double drops;
    double paperFps;
    double radius_mm = 0;      ///< of every drop; 0: the sizes of 25 mm/h
    double exposure_s = 5e-3;  ///< 0: drops that stand still
    double fov_deg = 60;
    bool environment = false;  ///< light, fog and depth
    bool lamps = false;
    Timed timed = Timed::Frame;
};

/// All rows of all three papers, in their order.
std::vector<PaperCase> paperCases();

struct PaperResult {
    PaperCase of;
    std::size_t drawn = 0;                                                ///< strokes in the picture
    double ms = 0;                                                        ///< of what is timed: the median
    double cells_ms = 0, drops_ms = 0, strokes_ms = 0, composite_ms = 0;  ///< medians; GPU times by timer queries
    std::string device;
};

struct TableOptions {
    std::vector<std::string> only;  ///< papers; empty: all
    int frames = 5;                 ///< timed, after one that warms up
    double largest = 5e6;           ///< cases of more drops are left out
    std::string device = "auto";
};

/// told: after each case. Throws Error(InvalidArgument) for a paper that does not exist, Error(Graphics).
std::vector<PaperResult> runPaperTables(const TableOptions& options,
                                        const std::function<void(const PaperResult&)>& told);

/// A Markdown table for each paper's.
std::string paperTablesText(const std::vector<PaperResult>& results);
nlohmann::ordered_json paperTablesJson(const std::vector<PaperResult>& results);

}  // namespace virga::bench
