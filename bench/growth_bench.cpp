// How time grows with what is asked for: strokes, pixels, rain rate, frames. None should grow faster than linearly.
//   bench_growth OUT [--device cpu|gpu|auto|N] [--only strokes|pixels|rate|frames]
// OUT.csv gets every point, OUT.svg the charts with the exponents fitted to their upper halves; the exponents are
// printed, and the exit code is 1 if one is over `mostExponent`. Time is that of all processors together, the least of
// three runs: a busy machine does not stretch it. On a device of its own it is the time that passes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "core/Error.h"
#include "plot/Chart.h"
#include "shot/Compositor.h"

namespace {

using namespace virga;

/// Linear, and what times scatter by.
constexpr double mostExponent = 1.1;

struct Shot {
    int width = 640, height = 360, frames = 2;
    shot::Settings settings;
};

/// One thing that grows.
struct Growth {
    const char *name, *axis;
    std::vector<double> values;
    std::function<void(Shot&, double)> set;
};

shot::Settings street()
{
    shot::Settings s;
    s.ground = "1.6,4";
    return s;
}

const std::vector<Growth> growths = {
    {"strokes",
     "strokes in a frame of 640x360",
     {1e4, 3e4, 1e5, 3e5, 1e6, 2e6},
     [](Shot& shot, double strokes) { shot.settings.strokes = strokes; }},
    {"pixels",
     "pixels, 100,000 strokes",
     {320 * 180, 640 * 360, 1280 * 720, 2560 * 1440, 3840 * 2160},
     [](Shot& shot, double pixels) {
         shot.width = int(std::lround(std::sqrt(pixels * 16 / 9)));
         shot.height = shot.width * 9 / 16;
         shot.settings.strokes = 1e5;
     }},
    {"rate",
     "rain rate [mm/h], 1280x720",
     {1, 3, 10, 30, 100, 300},
     [](Shot& shot, double rate) {
         shot.width = 1280;
         shot.height = 720;
         shot.settings.rate_mm_h = rate;
     }},
    {"frames",
     "frames of 640x360, 25 mm/h",
     {1, 2, 4, 8, 16, 32},
     [](Shot& shot, double frames) { shot.frames = int(frames); }},
};

double seconds(bool ofProcessors)
{
    timespec now{};
    clock_gettime(ofProcessors ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Time of all frames of a shot [ms], without opening it; the first frame, which allocates, is not one of them.
double timeOf(const Shot& shot, const std::string& device)
{
    shot::Compositor compositor(shot.settings, {shot.width, shot.height, 24, 0},
                                {.wanted = {}, .device = device, .shaderFolder = {}}, {});
    const bool isProcessor = device == "cpu";
    const auto render = [&](FrameNumber number) {
        io::PlateFrame plate;
        plate.number = number;
        plate.pixels = ImageF(shot.width, shot.height, 4, 0.5f);
        compositor.render(std::move(plate));
    };
    render(0);
    double least = 1e30;
    for (int run = 0; run < 3; ++run) {
        const double start = seconds(isProcessor);
        for (int frame = 1; frame <= shot.frames; ++frame) render(frame);
        least = std::min(least, 1e3 * (seconds(isProcessor) - start));
    }
    return least;
}

/// Of y = c x^p, by least squares of the logarithms from the middle on: before it what does not grow counts.
double exponentOf(const std::vector<double>& x, const std::vector<double>& y)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (std::size_t i = x.size() / 2; i < x.size(); ++i) {
        const double u = std::log(x[i]), v = std::log(y[i]);
        n += 1, sx += u, sy += v, sxx += u * u, sxy += u * v;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

}  // namespace

int main(int argc, char** argv)
try {
    std::string out, device = "cpu", only;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word == "--device" && i + 1 < argc)
            device = argv[++i];
        else if (word == "--only" && i + 1 < argc)
            only = argv[++i];
        else if (out.empty() && !word.starts_with("-"))
            out = word;
        else
            throw Error(ErrorCode::InvalidArgument, "'{}' is no flag, or lacks its value; see bench/growth_bench.cpp",
                        word);
    }
    if (out.empty()) throw Error(ErrorCode::InvalidArgument, "where to? bench_growth OUT makes OUT.csv and OUT.svg");
    std::ofstream table(out + ".csv"), drawing(out + ".svg");
    if (!table || !drawing) throw Error(ErrorCode::Output, "'{}': cannot be written", out);

    table << "grows,value,ms\n";
    std::vector<plot::Chart> charts;
    bool isLinear = true;
    for (const Growth& growth : growths) {
        if (!only.empty() && only != growth.name) continue;
        plot::Series measured{.name = "measured", .markers = true}, linear{.name = "linear", .dashed = true};
        for (const double value : growth.values) {
            Shot shot;
            shot.settings = street();
            growth.set(shot, value);
            measured.x.push_back(value);
            measured.y.push_back(timeOf(shot, device));
            table << growth.name << "," << value << "," << measured.y.back() << "\n";
        }
        const double exponent = exponentOf(measured.x, measured.y);
        isLinear = isLinear && exponent <= mostExponent;
        fmt::print("{:<8} exponent {:.2f}:", growth.name, exponent);
        for (std::size_t i = 0; i < measured.x.size(); ++i)
            fmt::print(" {:g}: {:.1f} ms", measured.x[i], measured.y[i]);
        fmt::print("\n");
        std::fflush(stdout);
        linear.x = {measured.x.front(), measured.x.back()};
        linear.y = {measured.y.back() * linear.x[0] / linear.x[1], measured.y.back()};
        charts.push_back({.title = fmt::format("Time against {}", growth.name),
                          .subtitle = fmt::format("grows with the power {:.2f} in the upper half", exponent),
                          .x = {.label = growth.axis, .scale = plot::Scale::Logarithmic},
                          .y = {.label = "time [ms]", .scale = plot::Scale::Logarithmic},
                          .series = {measured, linear}});
    }
    if (charts.empty()) throw Error(ErrorCode::InvalidArgument, "--only '{}': nothing of that name grows", only);
    drawing << plot::svg(charts);
    return isLinear ? 0 : 1;
} catch (const virga::Error& error) {
    fmt::print(stderr, "bench_growth: {}\n", error.what());
    return virga::exitCode(error.code());
}
