// Run time against error of the extraction, for what a user can set: --tolerance and --iterations.
//   bench_extract_curve [--width N] [--height N] [--csv FILE] [--svg FILE]
// Footage is drawn: 20 frames, 720 x 480 unless said otherwise, strokes at a slant of 6 degrees over a textured scene,
// noise of 2/255, C unknown. Two tables:
//   equation    Eq. (1) with bounds and a fixed cost (matte/Alternation.h), C known: F after each iteration, above the
//               least that was ever reached, for several tolerances of the steps
//   extraction  the whole of matte::extractRain: RMSE of alpha and scene against the drawn ones
// Wall-clock time, the least of three runs, the machine first. CSV:
// table,tolerance,iterations,ms,objective_above_least, alpha_rmse,scene_rmse
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "core/Error.h"
#include "core/Timer.h"
#include "matte/Alternation.h"
#include "matte/DrawnRain.h"
#include "matte/RainExtraction.h"
#include "plot/Chart.h"
#include "support/Scores.h"

namespace {

using namespace virga;

constexpr int runs = 3;
constexpr double slant = 0.105;

struct Row {
    std::string table;
    double tolerance;
    int iterations;
    double ms, objective, alphaRmse, sceneRmse;
};

test::DrawnRain drawFootage(int width, int height)
{
    test::DrawnRainOptions options;
    options.width = width;
    options.height = height;
    options.frames = 20;
    options.strokes = width * height / 600;  // 16 % of the pixels
    options.slant = slant;
    options.noise = 2.0 / 255;
    return test::drawRain(options);
}

double alphaRmse(const std::vector<ImageF>& found, const std::vector<ImageF>& truth)
{
    double square = 0.0;
    for (std::size_t k = 0; k < found.size(); ++k)
        for (std::size_t i = 0; i < found[k].size(); ++i)
            square += std::pow(double(found[k].data()[i]) - truth[k].data()[i], 2) / double(found[k].size());
    return std::sqrt(square / double(found.size()));
}

double sceneRmse(const ImageF& found, const ImageF& truth) { return alphaRmse({found}, {truth}); }

Row solveEquation(const test::DrawnRain& drawn, double tolerance, int iterations)
{
    Row row{"equation", tolerance, iterations, 1e30, 0, 0, 0};
    for (int run = 0; run < runs; ++run) {
        matte::AlternationOptions options;
        options.terms.color = {0.78f, 0.80f, 0.82f};
        options.terms.slant = slant;
        options.terms.eta = 0.0034;
        options.iterations = iterations;
        options.stepTolerance = tolerance;
        const Timer timer;
        const matte::Alternation found = alternate({drawn.frames}, options);
        row.ms = std::min(row.ms, timer.milliseconds());
        row.objective = found.history.back().total();
        row.alphaRmse = alphaRmse(found.alphas, drawn.alphas);
        row.sceneRmse = sceneRmse(found.scene, drawn.scene);
    }
    return row;
}

Row extract(const test::DrawnRain& drawn, double tolerance, int iterations)
{
    Row row{"extraction", tolerance, iterations, 1e30, 0, 0, 0};
    for (int run = 0; run < runs; ++run) {
        std::vector<ImageF> frames = drawn.frames;
        matte::ExtractionOptions options;
        options.tolerance = tolerance;
        options.rounds = iterations;
        const Timer timer;
        const matte::Extraction found = matte::extractRain(frames, options);
        row.ms = std::min(row.ms, timer.milliseconds());
        row.objective = found.history.back().total();
        row.alphaRmse = alphaRmse(found.alphas, drawn.alphas);
        row.sceneRmse = sceneRmse(found.scene, drawn.scene);
    }
    return row;
}

/// Objectives as what they are above the least of their table, relative.
void relate(std::vector<Row>& rows, const char* table)
{
    double least = 1e300;
    for (const Row& row : rows)
        if (row.table == table) least = std::min(least, row.objective);
    for (Row& row : rows)
        if (row.table == table) row.objective = row.objective / least - 1;
}

std::vector<plot::Chart> chartsOf(const std::vector<Row>& rows)
{
    plot::Chart objective, error;
    objective.title = "F above its least, against time";
    error.title = "Error of alpha, against time";
    for (plot::Chart* chart : {&objective, &error}) {
        chart->subtitle = "20 frames; a dot an iteration";
        chart->x = {.label = "time [ms]", .scale = plot::Scale::Logarithmic};
        chart->y.scale = plot::Scale::Logarithmic;
    }
    objective.y.label = "F / least F - 1";
    error.y.label = "RMSE of alpha";
    for (const char* table : {"equation", "extraction"})
        for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-6}) {
            plot::Series series;
            series.name = fmt::format("{}, tolerance {:g}", table, tolerance);
            series.markers = true;
            std::vector<double> above;
            for (const Row& row : rows) {
                if (row.table != table || row.tolerance != tolerance) continue;
                series.x.push_back(row.ms);
                series.y.push_back(row.alphaRmse);
                above.push_back(row.objective);
            }
            error.series.push_back(series);
            series.y = above;
            if (std::string(table) == "equation") objective.series.push_back(std::move(series));
        }
    return {objective, error};
}

int numberFrom(const std::string& flag, const std::string& text)
{
    int value = 0;
    const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (problem != std::errc() || end != text.data() + text.size() || value < 16 || value > 16384)
        throw Error(ErrorCode::InvalidArgument, "{} '{}': must be 16 to 16384", flag, text);
    return value;
}

}  // namespace

int main(int argc, char** argv)
try {
    int width = 720, height = 480;
    std::string csv, svg;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i], value = argv[i + 1];
        if (flag == "--width")
            width = numberFrom(flag, value);
        else if (flag == "--height")
            height = numberFrom(flag, value);
        else if (flag == "--csv")
            csv = value;
        else if (flag == "--svg")
            svg = value;
        else
            throw Error(ErrorCode::InvalidArgument, "no flag is called '{}'", flag);
    }
    std::printf("%u threads; 20 frames of %d x %d\n", std::thread::hardware_concurrency(), width, height);
    const test::DrawnRain drawn = drawFootage(width, height);
    std::vector<Row> rows;
    for (const double tolerance : {1e-2, 1e-3, 1e-4, 1e-6}) {
        for (const int iterations : {1, 2, 3, 5, 10, 20}) rows.push_back(solveEquation(drawn, tolerance, iterations));
        for (const int iterations : {1, 2, 3, 4, 6}) rows.push_back(extract(drawn, tolerance, iterations));
    }
    relate(rows, "equation");
    std::string text = "table,tolerance,iterations,ms,objective_above_least,alpha_rmse,scene_rmse\n";
    for (const Row& row : rows)
        text += fmt::format("{},{:g},{},{:.1f},{:.3g},{:.5f},{:.5f}\n", row.table, row.tolerance, row.iterations,
                            row.ms, row.table == "equation" ? row.objective : 0.0, row.alphaRmse, row.sceneRmse);
    std::fputs(text.c_str(), stdout);
    if (!csv.empty()) std::ofstream(csv) << text;
    if (!svg.empty()) std::ofstream(svg) << plot::svg(chartsOf(rows));
    return 0;
} catch (const virga::Error& error) {
    std::fprintf(stderr, "bench_extract_curve: %s\n", error.what());
    return virga::exitCode(error.code());
}
