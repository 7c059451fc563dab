// What `virga bench curves` leaves in its folder: for each knob a table (KNOB.csv) and charts (KNOB.svg), the pictures
// (KNOB_CLIP_*.png) and one page with all of it (index.html).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/Knob.h"

namespace virga::bench {

/// Every file appears whole or not at all; the page is there, and shows what exists, after each knob.
class CurveReport {
public:
    /// Makes the folder. heading: what all curves were measured on, a sentence. Throws Error(Output).
    CurveReport(std::string folder, std::string heading);

    /// Collects what `knob` is measured at, until finish() writes it.
    Record& begin(const Knob& knob);
    /// Throws Error(Output).
    void finish();

private:
    struct Collected final : Record {
        void point(const Point& point) override;
        void picture(const std::string& clip, const std::string& caption, const ImageF& pixels) override;

        Knob knob;
        std::filesystem::path folder;
        std::vector<Point> points;
        struct Shown {
            std::string clip, caption, file;
        };
        std::vector<Shown> pictures;
    };

    std::filesystem::path folder_;
    std::string heading_, sections_;
    Collected now_;
};

/// Of the points of one clip, variant and value, over seeds.
struct Summary {
    std::string clip, variant;
    std::optional<double> value;
    double ms = 0;                             ///< mean
    std::vector<double> mean, least, largest;  ///< of each measure
    std::size_t seeds = 0;
};

/// In the order in which they came.
std::vector<Summary> summarize(const std::vector<Point>& points);

/// The table as CSV: clip, variant, value (empty: the base line), seed, ms, then the measures by name.
std::string curveTable(const Knob& knob, const std::vector<Point>& points);

/// Error against time, and against the value, as SVG: a line a clip and variant with the spread over seeds, the default
/// as a black dot, the base line dashed.
std::string curveCharts(const Knob& knob, const std::vector<Point>& points);

}  // namespace virga::bench
