#include "bench/PaperTables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "core/Error.h"
#include "core/Timer.h"
#include "core/Words.h"
#include "particles/RainField.h"
#include "rainfall/TerminalSpeed.h"
#include "shot/AtlasFile.h"
#include "shot/LampReach.h"
#include "shot/PictureRenderer.h"

namespace virga::bench {
namespace {

constexpr particles::Visibility visibility{.near_m = 0.5, .far_m = 500, .threshold = 0.002};

/// Drops of one size, one a cubic metre.
rainfall::SizeClass onlySize(double diameter)
{
    const double square = diameter * diameter;
    return {.d0 = diameter,
            .d1 = diameter,
            .numberPerVolume = 1,
            .speed = rainfall::terminalSpeed(diameter),
            .speedError = 0,
            .meanDiameter = diameter,
            .meanSquare = square,
            .meanCube = square * diameter,
            .weight = 1};
}

/// As many drops in view as the case has.
particles::RainField fieldOf(const PaperCase& c, const camera::Projection& projection)
{
    const rainfall::DropSizes sizes(25);
    const particles::Motion motion({.wind = {0.8, 0.0}, .gust = 0.3, .turbulence = 0.25});
    const auto classes = c.radius_mm > 0 ? std::vector{onlySize(2e-3 * c.radius_mm)} : rainfall::makeSizeClasses(sizes);
    const particles::RainField plain(classes, sizes.slope(), motion, 1);
    return {classes,
            sizes.slope(),
            motion,
            1,
            c.drops / plain.expectedStrokes(projection, c.exposure_s, visibility),
            particles::RainField::dropsPerCellFor(c.drops)};
}

/// A road 1.6 m under the camera, the sky above it.
ImageF groundDepth(int width, int height, double focal_px)
{
    ImageF depth(width, height, 1, std::numeric_limits<float>::infinity());
    for (int y = height / 2 + 1; y < height; ++y)
        for (int x = 0; x < width; ++x) depth.at(x, y) = float(1.6 * focal_px / (y + 0.5 - 0.5 * height));
    return depth;
}

shared::FrameConstants constantsOf(const PaperCase& c, const camera::Projection& projection)
{
    shared::FrameConstants constants{};
    constants.cameraFromWorldOpen = constants.cameraFromWorldClose = glm::mat4(1.0f);
    const auto focal = float(projection.focal_px);
    constants.lens = {focal, focal, 0.5f * float(c.width), 0.5f * float(c.height)};
    constants.range = {float(visibility.near_m), float(visibility.far_m), float(visibility.threshold), 1};
    constants.focus = {0, 0.1f, float(c.exposure_s), 20};
    constants.picture = {c.width, c.height, 0, 0};
    constants.lights.x = c.lamps ? 1 : 0;
    constants.medium.x = c.lamps ? 0.005f : 0.0f;
    return constants;
}

double medianOf(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

PaperResult measure(const PaperCase& c, const TableOptions& options)
{
    particles::Exposure exposure;
    exposure.duration_s = c.exposure_s;
    exposure.projection = camera::projectionFromHorizontalFov(c.width, c.height, c.fov_deg * std::numbers::pi / 180);
    const particles::RainField field = fieldOf(c, exposure.projection);
    passes::Features features;
    features.rain = true;
    features.fog = features.depth = c.environment;
    features.lights = c.lamps;
    const std::vector<float> ringTransfer = c.lamps ? shot::ringTransferTable() : std::vector<float>();
    const auto renderer = shot::makePictureRenderer(
        {c.width, c.height, features, shot::builtInAtlas(1), grade::ColorLut{}, ringTransfer, options.device, {}});
    const ImageF depth = groundDepth(c.width, c.height, exposure.projection.focal_px), white(64, 32, 3, 0.9f);
    if (c.environment) renderer->setDepth(depth);
    if (c.environment) renderer->setFogTable(std::vector<float>(shared::fogTableSize, 0.05f));
    renderer->setDropRadiance(white, white);
    const shared::PointLight lamp{{1, 1, -6, 0.1f}, {2, 1, 0.5f, 0}};
    if (c.lamps) renderer->setLamps({&lamp, 1});

    PaperResult result;
    result.of = c;
    result.device = renderer->device();
    std::map<std::string, std::vector<double>> times;
    for (int frame = -1; frame < options.frames; ++frame) {
        exposure.open_s = (frame + 1) / 24.0;
        ImageF plate(c.width, c.height, 4, 0.05f);
        const Timer clock;
        const particles::CellList cells = field.cellsInView(exposure, visibility);
        const double cells_ms = clock.milliseconds();
        const shot::DrawnPicture drawn =
            renderer->render({.pixels = std::move(plate), .rows = nullptr, .canvas = nullptr},
                             constantsOf(c, exposure.projection), cells, glm::mat3(1.0f));
        result.drawn = drawn.strokes;
        if (frame < 0) continue;  // compiles and warms up
        times["frame"].push_back(clock.milliseconds());
        times["cells"].push_back(cells_ms);
        for (const auto& [name, ms] : drawn.passMs) times[name].push_back(ms);
    }
    result.cells_ms = medianOf(times["cells"]);
    result.drops_ms = medianOf(times["drops"]);
    result.strokes_ms = medianOf(times["strokes"]);
    result.composite_ms = medianOf(times["composite"]) + medianOf(times["light"]);
    switch (c.timed) {
        case Timed::Frame: result.ms = medianOf(times["frame"]); break;
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
