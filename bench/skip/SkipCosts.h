// What leaving out saves on a scene that has something to leave out, and what looking for it costs on one that has not.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace bench {

/// One scene with one of shot::Skips on and off.
struct SkipTime {
    double with_ms = 0, without_ms = 0;        ///< medians of a frame, from plate to picture
    double withAll_ms = 0, withoutAll_ms = 0;  ///< time of all processors together, means
    double difference = 0;                     ///< greatest, of scene-linear light
};

struct SkipCost {
    std::string name;
    std::string scene, otherScene;  ///< that has something to leave out, and that has not; the latter may be empty
    SkipTime has, hasNot;
};

struct SkipBenchOptions {
    int width = 720, height = 480;
    int frames = 8;
    std::string device = "cpu";  ///< see shot::makePictureRenderer
    std::string only;            ///< part of a name; empty: all
};

/// Runs the cases one after the other; `done` is told of each. Throws virga::Error.
std::vector<SkipCost> measureSkips(const SkipBenchOptions& options, const std::function<void(const SkipCost&)>& done);

}  // namespace bench
