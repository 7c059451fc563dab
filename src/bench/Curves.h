// `virga bench curves`: run time against error, for the knobs that trade one for the other.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/Knob.h"

namespace virga::bench {

struct CurveOptions {
    std::string out = "bench";        ///< folder
    std::string samples = "samples";  ///< the sample street
    std::string footage;              ///< three more clips; empty: the sample alone
    std::vector<std::string> only;    ///< knobs; empty: all
    std::vector<double> values;       ///< in the place of each knob's own, and its default; empty: its own
    int columns = 96;                 ///< plates are averaged down to about that
    int seeds = 3;
    std::optional<double> opacity;  ///< of the strokes; nothing: the default
};

/// Fills the folder. told: after each knob, its name and how long it took [s]. Throws Error(InvalidArgument) for a knob
/// that does not exist, Error(Input) for a clip, Error(Output).
void runCurves(const CurveOptions& options, const std::function<void(const std::string& knob, double seconds)>& told);

}  // namespace virga::bench
