#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "bench/CurveReport.h"
#include "plot/Chart.h"

namespace virga::bench {
namespace {

constexpr double gap = std::numeric_limits<double>::quiet_NaN();
const char* const colors[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17a0c4", "#7a4b20", "#e377c2"};

bool spansDecades(double least, double largest) { return least > 0 && largest > 20 * least; }

/// Logarithmic where all is positive and differs a lot.
template <class Of>
plot::Scale scaleFor(const std::vector<Summary>& rows, Of&& of)
{
    double least = 1e300, largest = 0;
    for (const Summary& row : rows) {
        if (!row.value) continue;
        least = std::min(least, double(of(row)));
        largest = std::max(largest, double(of(row)));
    }
    return spansDecades(least, largest) ? plot::Scale::Logarithmic : plot::Scale::Linear;
}

/// The first measure over what `across` says of a row.
template <class Across>
void addLines(plot::Chart& chart, const Knob& knob, const std::vector<Summary>& rows, Across&& across)
{
    plot::Series standard{.name = "default", .markers = true, .line = false, .color = "#000000"};
    std::vector<plot::Series> lines, spreads;
    std::map<std::string, std::size_t> lineOf;
    std::vector<std::string> clips;
    for (const Summary& row : rows) {
        const std::string name = row.clip + (row.variant.empty() ? "" : ", " + row.variant);
        if (!row.value) continue;
        if (!row.variant.empty() && row.variant == knob.standardVariant) {  // a point and no line
            standard.x.push_back(across(row));
            standard.y.push_back(row.mean.front());
            continue;
        }
        if (!lineOf.count(name)) {
            lineOf[name] = lines.size();
            clips.push_back(row.clip);
            const std::string color = colors[lines.size() % std::size(colors)];
            lines.push_back({.name = name, .markers = true, .color = color});
            spreads.push_back({.color = color});
        }
        plot::Series &line = lines[lineOf[name]], &spread = spreads[lineOf[name]];
        const double x = across(row);
        line.x.push_back(x);
        line.y.push_back(row.mean.front());
        if (row.seeds > 1) {
            spread.x.insert(spread.x.end(), {x, x, gap});
            spread.y.insert(spread.y.end(), {row.least.front(), row.largest.front(), gap});
        }
        if (isStandard(knob, row.variant, row.value)) {
            standard.x.push_back(x);
            standard.y.push_back(row.mean.front());
        }
    }
    std::vector<plot::Series> baselines;
    for (const Summary& row : rows) {
        if (row.value) continue;
        const auto line = std::find(clips.begin(), clips.end(), row.clip);
        if (line == clips.end()) continue;
        const plot::Series& of = lines[std::size_t(line - clips.begin())];
        const auto [first, last] = std::minmax_element(of.x.begin(), of.x.end());
        baselines.push_back({.name = baselines.empty() ? knob.baseline : "",
                             .x = {*first, *last},
                             .y = {row.mean.front(), row.mean.front()},
                             .dashed = true,
                             .color = of.color});
    }
    for (auto* group : {&lines, &spreads, &baselines})
        for (plot::Series& series : *group) chart.series.push_back(std::move(series));
    if (!standard.x.empty()) chart.series.push_back(std::move(standard));
}

}  // namespace

std::string curveCharts(const Knob& knob, const std::vector<Point>& points)
{
    const std::vector<Summary> rows = summarize(points);
    const auto error = [](const Summary& row) { return row.mean.front(); };
    const auto time = [](const Summary& row) { return row.ms; };
    const auto value = [](const Summary& row) { return *row.value; };
    plot::Chart overTime{.title = knob.title, .subtitle = "against: " + knob.against};
    overTime.x = {.label = "time [ms]", .scale = scaleFor(rows, time)};
    overTime.y = {.label = knob.measures.front().meaning, .scale = scaleFor(rows, error)};
    plot::Chart overValue = overTime;
    overValue.title = "The same over the value";
    overValue.subtitle = {};
    overValue.x = {.label = knob.name + (knob.unit.empty() ? "" : " [" + knob.unit + "]"),
                   .scale = scaleFor(rows, value)};
    addLines(overTime, knob, rows, time);
    addLines(overValue, knob, rows, value);
    return plot::svg(std::vector{overTime, overValue});
}

}  // namespace virga::bench
