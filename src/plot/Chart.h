// Line charts as SVG: what `virga model --plot` and the benchmarks draw. Text stays text, so that it can be searched
// and scales; the background is opaque, so that a page in dark mode shows the same picture.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace virga::plot {

enum class Scale {
    Linear,
    Logarithmic,  ///< decades; what is not positive is left out
    Decibel,      ///< values are powers or their errors; shown as 10 log10
};

struct Axis {
    std::string label = {};  ///< with the unit: "rain rate [mm/h]"
    Scale scale = Scale::Linear;
    std::optional<double> low = {},
                          high = {};  ///< where the axis ends; else a little beyond the data, at a round number
    double tickStep = 0;              ///< linear axes alone, e.g. 30 for angles; 0: about six, at round numbers
};

struct Series {
    std::string name = {};               ///< for the legend; empty: not in it
    std::vector<double> x = {}, y = {};  ///< as many each; a NaN interrupts the line
    bool markers = false;                ///< a dot at each point
    bool line = true;
    bool dashed = false;
    std::string color = {};  ///< "#rrggbb"; empty: the palette's next
};

struct Chart {
    std::string title = {}, subtitle = {};
    Axis x = {}, y = {};
    std::vector<Series> series = {};
    bool equalScales = false;  ///< a unit is as long across as it is up: for outlines
};

/// The values at which an axis from `low` to `high` (low < high, as the axis shows them: decibels for that scale) is
/// labelled: 1, 2 or 5 times a power of ten apart, at most `most` (>= 2) of them; decades on a logarithmic axis, with 2
/// and 5 between them where there are few.
std::vector<double> ticks(double low, double high, Scale scale, int most);

/// The label of a tick: "0.25", "10⁻⁴", never "-0" or "0.30000000000000004". step  distance to the next.
std::string tickLabel(double value, double step, Scale scale);

/// The charts below each other as one SVG document, UTF-8, 760 units wide.
std::string svg(std::span<const Chart> charts);

}  // namespace virga::plot
