#include "bench/CurveReport.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/Error.h"
#include "io/AtomicFile.h"
#include "io/Plate.h"

namespace virga::bench {
namespace {

/// Text as HTML shows it.
std::string escaped(const std::string& text)
{
    std::string html;
    for (const char c : text) html += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return html;
}

/// A cell of a CSV file (RFC 4180).
std::string quoted(const std::string& text)
{
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string cell = "\"";
    for (const char c : text) cell += c == '"' ? "\"\"" : std::string(1, c);
    return cell + '"';
}

/// Letters, digits, dots and dashes stay.
std::string fileNameOf(const std::string& text)
{
    std::string name;
    for (const char c : text) name += std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' ? c : '_';
    return name;
}

const char* const head = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Run time against error</title>
<style>
body { font: 15px/1.45 sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em; background: #fff; color: #222 }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: 2px 9px; text-align: right }
th { border-bottom: 1px solid #888 } td:first-child, th:first-child { text-align: left }
tr.default { font-weight: bold } tr.baseline { font-style: italic } small { color: #777 }
figure { display: inline-block; margin: 4px } figcaption { font-size: 12px; text-align: center }
figure img { width: 270px; image-rendering: pixelated; display: block }
</style></head><body>
<h1>Run time against error</h1>
)";

std::string tableRow(const Knob& knob, const Summary& row)
{
    std::string html = fmt::format("<tr{}><td>{}<td>{}<td>{}<td>{:.3g}",
                                   !row.value                                 ? " class=\"baseline\""
                                   : isStandard(knob, row.variant, row.value) ? " class=\"default\""
                                                                              : "",
                                   escaped(row.clip), escaped(row.value ? row.variant : knob.baseline),
                                   row.value ? fmt::format("{:g}", *row.value) : "", row.ms);
    for (std::size_t i = 0; i < row.mean.size(); ++i) {
        html += fmt::format("<td>{:.3g}", row.mean[i]);
        if (row.seeds > 1) html += fmt::format(" <small>{:.3g}–{:.3g}</small>", row.least[i], row.largest[i]);
    }
    return html + "</tr>\n";
}

}  // namespace

std::vector<Summary> summarize(const std::vector<Point>& points)
{
    std::vector<Summary> rows;
    for (const Point& p : points) {
        auto row = std::find_if(rows.begin(), rows.end(), [&](const Summary& r) {
            return r.clip == p.clip && r.variant == p.variant && r.value == p.value;
        });
        if (row == rows.end()) {
            row = rows.insert(rows.end(), Summary{p.clip, p.variant, p.value, 0, {}, p.errors, p.errors, 0});
            row->mean.resize(p.errors.size());
        }
        ++row->seeds;
        row->ms += p.ms;
        for (std::size_t i = 0; i < p.errors.size(); ++i) {
            row->mean[i] += p.errors[i];
            row->least[i] = std::min(row->least[i], p.errors[i]);
            row->largest[i] = std::max(row->largest[i], p.errors[i]);
        }
    }
    for (Summary& row : rows) {
        row.ms /= double(row.seeds);
        for (double& mean : row.mean) mean /= double(row.seeds);
    }
    return rows;
}

std::string curveTable(const Knob& knob, const std::vector<Point>& points)
{
    std::string csv = "clip,variant,value,seed,ms";
    for (const Measure& measure : knob.measures) csv += "," + measure.name;
    csv += "\n";
    for (const Point& p : points) {
        csv += fmt::format("{},{},{},{},{:.4f}", quoted(p.clip), quoted(p.variant),
                           p.value ? fmt::format("{:g}", *p.value) : "", p.seed, p.ms);
        for (const double error : p.errors) csv += fmt::format(",{:.6g}", error);
        csv += "\n";
    }
    return csv;
}

CurveReport::CurveReport(std::string folder, std::string heading)
    : folder_(std::move(folder)), heading_(std::move(heading))
{
    std::error_code problem;
    std::filesystem::create_directories(folder_, problem);
    if (problem)
        throw Error(ErrorCode::Output, "'{}': the folder cannot be made: {}", folder_.string(), problem.message());
    io::checkOutputFolder((folder_ / "index.html").string());
}

void CurveReport::Collected::point(const Point& p) { points.push_back(p); }

void CurveReport::Collected::picture(const std::string& clip, const std::string& caption, const ImageF& pixels)
{
    const std::string file = fileNameOf(fmt::format("{}_{}_{}", knob.name, clip, caption)) + ".png";
    io::writePng((folder / file).string(), pixels);
    pictures.push_back({clip, caption, file});
}

Record& CurveReport::begin(const Knob& knob)
{
    now_ = {};
    now_.knob = knob;
    now_.folder = folder_;
    return now_;
}

void CurveReport::finish()
{
    const Knob& knob = now_.knob;
    const auto path = [&](const std::string& name) { return (folder_ / name).string(); };
    io::writeWholeFile(path(knob.name + ".csv"), curveTable(knob, now_.points));
    io::writeWholeFile(path(knob.name + ".svg"), curveCharts(knob, now_.points));

    std::string& html = sections_;
    html += fmt::format(
        "<h2 id=\"{0}\">{1}</h2>\n<p>Truth: {2}. Time: {3}. Default: {4} (bold, black dots). "
        "<a href=\"{0}.csv\">Table</a></p>\n<p><img src=\"{0}.svg\" alt=\"{1}\"></p>\n<table>\n<tr><th>clip<th><th>{6}"
        "<th>ms",
        knob.name, escaped(knob.title), escaped(knob.against), escaped(knob.timed),
        knob.standardVariant.empty() ? fmt::format("{:g} {}", knob.standard, knob.unit) : knob.standardVariant,
        knob.unit, knob.unit.empty() ? "value" : knob.unit);
    for (const Measure& m : knob.measures)
        html += fmt::format("<th title=\"{}\">{}", escaped(m.meaning), escaped(m.name));
    html += "</tr>\n";
    for (const Summary& row : summarize(now_.points)) html += tableRow(knob, row);
    html += "</table>\n<p>";
    for (const Measure& m : knob.measures) html += fmt::format("<b>{}</b>: {}. ", escaped(m.name), escaped(m.meaning));
    html += "Means over seeds, and the least and the largest.</p>\n";
    for (std::size_t i = 0; i < now_.pictures.size(); ++i) {
        const auto& shown = now_.pictures[i];
        if (i == 0 || shown.clip != now_.pictures[i - 1].clip)
            html += fmt::format("<h3>{}</h3>\n", escaped(shown.clip));
        html += fmt::format("<figure><img src=\"{}\" alt=\"\"><figcaption>{}</figcaption></figure>\n", shown.file,
                            escaped(shown.caption));
    }
    io::writeWholeFile(path("index.html"),
                       fmt::format("{}<p>{}</p>\n{}</body></html>\n", head, escaped(heading_), sections_));
}

}  // namespace virga::bench
