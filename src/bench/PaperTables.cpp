#include "bench/PaperTables.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "bench/PlainRain.h"
#include "core/Error.h"
#include "shot/AtlasFile.h"

namespace virga::bench {
namespace {

/// The drops of a case, as many in view as it has.
particles::RainField fieldOf(const PaperCase& c, const PlainScene& scene)
{
    if (c.radius_mm > 0) return fieldOfSize(2e-3 * c.radius_mm, scene, c.drops, 1);
    const double expected =
        fieldOfRate(25, 1).expectedStrokes(exposureOf(scene, 0).projection, c.exposure_s, scene.visibility);
    return fieldOfRate(25, 1, c.drops / expected, particles::RainField::dropsPerCellFor(c.drops));
}

PaperResult measure(const PaperCase& c, const TableOptions& options)
{
    const PlainScene scene{.width = c.width,
                           .height = c.height,
                           .fov_deg = c.fov_deg,
                           .exposure_s = c.exposure_s,
                           .environment = c.environment,
                           .lamps = c.lamps};
    const particles::RainField field = fieldOf(c, scene);
    PlainRain rain(scene, shot::builtInAtlas(1), options.device);
    PaperResult result;
    result.of = c;
    result.device = rain.device();
    rain.render(field);  // compiles and warms up
    std::vector<double> all, cells, drops, strokes, composite;
    for (int frame = 1; frame <= options.frames; ++frame) {
        const PlainRain::Frame drawn = rain.render(field, frame);
        result.drawn = drawn.picture.strokes;
        all.push_back(drawn.all_ms);
        cells.push_back(drawn.cells_ms);
        drops.push_back(drawn.passMs("drops"));
        strokes.push_back(drawn.passMs("strokes"));
        composite.push_back(drawn.passMs("light") + drawn.passMs("composite"));
    }
    result.cells_ms = medianOf(cells);
    result.drops_ms = medianOf(drops);
    result.strokes_ms = medianOf(strokes);
    result.composite_ms = medianOf(composite);
    switch (c.timed) {
        case Timed::Frame: result.ms = medianOf(all); break;
        case Timed::Animation: result.ms = result.cells_ms + result.drops_ms; break;
        case Timed::Drawing: result.ms = result.strokes_ms + result.composite_ms; break;
    }
    return result;
}

/// 1280000 -> "1,280,000".
std::string grouped(double number)
{
    std::string text = fmt::format("{:.0f}", number);
    for (int at = int(text.size()) - 3; at > 0; at -= 3) text.insert(text.begin() + at, ',');
    return text;
}

const char* wordFor(Timed timed)
{
    return timed == Timed::Frame       ? "the whole frame"
           : timed == Timed::Animation ? "cells and drops"
                                       : "strokes and composite";
}

void appendWang(std::vector<PaperCase>& cases)
{
    const double fps[] = {790, 328, 223, 162, 130, 104, 91, 77};
    for (int i = 0; i < 8; ++i) {
        const double strokes = 1e4 * (i + 1);
        cases.push_back({.paper = "wang",
                         .table = "Table 3",
                         .what = grouped(strokes) + " strokes",
                         .width = 720,
                         .height = 480,
                         .drops = strokes,
                         .paperFps = fps[i],
                         .environment = true});
    }
}

void appendNvidia(std::vector<PaperCase>& cases)
{
    const double particles[] = {2e5, 1e6, 5e6}, animated[] = {574, 257, 67}, drawn[] = {545, 126, 26};
    for (const Timed timed : {Timed::Animation, Timed::Drawing})
        for (int i = 0; i < 3; ++i)
            cases.push_back({.paper = "nvidia",
                             .table = timed == Timed::Animation ? "Table 1, animating" : "Table 2, drawing",
                             .what = grouped(particles[i]) + " particles",
                             .width = 1280,
                             .height = 1024,
                             .drops = particles[i],
                             .paperFps = timed == Timed::Animation ? animated[i] : drawn[i],
                             .fov_deg = 45,
                             .timed = timed});
}

void appendRousseau(std::vector<PaperCase>& cases)
{
    const auto add = [&](const char* table, int width, int height, double count, double radius, bool streaks,
                         bool lamps, double fps) {
        cases.push_back({.paper = "rousseau",
                         .table = table,
                         .what = fmt::format("{} {}, R {:g} mm", grouped(count), streaks ? "streaks" : "drops", radius),
                         .width = width,
                         .height = height,
                         .drops = count,
                         .paperFps = fps,
                         .radius_mm = radius,
                         .exposure_s = streaks ? 5e-3 : 0,
                         .lamps = lamps});
    };
    for (const bool lamps : {false, true}) {
        const char* const table = lamps ? "Table 4, with lamps" : "Table 4, without lamps";
        add(table, 1024, 768, 1e4, 3, false, lamps, lamps ? 55 : 61);
        add(table, 1024, 768, 4e3, 1.5, true, lamps, lamps ? 81 : 104);
    }
    const struct {
        int width, height;
        double fps[6];
    } rows[] = {{800, 600, {196, 187, 66, 56, 108, 48}},
                {1024, 768, {174, 162, 63, 50, 96, 43}},
                {1280, 1024, {148, 134, 59, 43, 85, 37}}};
    for (const auto& row : rows) {
        int column = 0;
        for (const double count : {1e3, 1e4})
            for (const double radius : {1.0, 4.0})
                add("Table 5, with lamps", row.width, row.height, count, radius, false, true, row.fps[column++]);
        add("Table 5, with lamps", row.width, row.height, 4e3, 0.5, true, true, row.fps[column++]);
        add("Table 5, with lamps", row.width, row.height, 1e4, 1.5, true, true, row.fps[column]);
    }
}

}  // namespace

std::vector<PaperCase> paperCases()
{
    std::vector<PaperCase> cases;
    appendWang(cases);
    appendNvidia(cases);
    appendRousseau(cases);
    return cases;
}

std::vector<PaperResult> runPaperTables(const TableOptions& options,
                                        const std::function<void(const PaperResult&)>& told)
{
    const std::vector<std::string> papers = {"wang", "nvidia", "rousseau"};
    for (const std::string& wanted : options.only)
        if (std::find(papers.begin(), papers.end(), wanted) == papers.end())
            throw Error(ErrorCode::InvalidArgument, "--only '{}': must be {}", wanted, fmt::join(papers, ", "));
    std::vector<PaperResult> results;
    for (const PaperCase& c : paperCases()) {
        const bool isWanted =
            options.only.empty() || std::find(options.only.begin(), options.only.end(), c.paper) != options.only.end();
        if (!isWanted || c.drops > options.largest) continue;
        results.push_back(measure(c, options));
        told(results.back());
    }
    return results;
}

std::string paperTablesText(const std::vector<PaperResult>& results)
{
    std::string text;
    if (!results.empty())
        text += fmt::format("{}, {} threads\n", results.front().device, std::thread::hardware_concurrency());
    std::string table;
    for (const PaperResult& r : results) {
        const PaperCase& c = r.of;
        if (const std::string now = fmt::format("{} {}", c.paper, c.table); now != table) {
            table = now;
            text += fmt::format(
                "\n{}: {}; {}\n\n| case | drawn | paper fps | here fps | times as fast | ms: {} | cells | drops | "
                "strokes | "
                "light, composite |\n|---|---|---|---|---|---|---|---|---|---|\n",
                c.paper, c.table, wordFor(c.timed), wordFor(c.timed));
        }
        text +=
            fmt::format("| {}, {}x{} | {} | {:g} | {:.0f} | {:.2g} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n",
                        c.what, c.width, c.height, grouped(double(r.drawn)), c.paperFps, 1e3 / r.ms,
                        1e3 / r.ms / c.paperFps, r.ms, r.cells_ms, r.drops_ms, r.strokes_ms, r.composite_ms);
    }
    return text;
}

nlohmann::ordered_json paperTablesJson(const std::vector<PaperResult>& results)
{
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const PaperResult& r : results)
        rows.push_back({{"paper", r.of.paper},
                        {"table", r.of.table},
                        {"case", r.of.what},
                        {"width", r.of.width},
                        {"height", r.of.height},
                        {"drawn", r.drawn},
                        {"timed", wordFor(r.of.timed)},
                        {"paper_fps", r.of.paperFps},
                        {"fps", 1e3 / r.ms},
                        {"ms", r.ms},
                        {"cells_ms", r.cells_ms},
                        {"drops_ms", r.drops_ms},
                        {"strokes_ms", r.strokes_ms},
                        {"composite_ms", r.composite_ms},
                        {"device", r.device}});
    return {{"threads", std::thread::hardware_concurrency()}, {"rows", std::move(rows)}};
}

}  // namespace virga::bench
