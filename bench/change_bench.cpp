// What a slider costs: a parameter is moved there and back, and the next frame rendered, beside a shot made anew for
// it.
//   bench_change [--device cpu|gpu|auto|N] [--size WIDTHxHEIGHT] [--rounds N] [--only PARAMETER]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/Timer.h"
#include "shot/Compositor.h"
#include "shot/Parameters.h"

namespace {

using namespace virga;

struct Options {
    int width = 960, height = 540, rounds = 8;
    std::string device = "cpu", only;
};

struct Move {
    const char *parameter, *text;
};
constexpr Move moves[] = {{"darken", "0.3"},   {"blur", "1.5"},       {"fog-color", "0.5,0.5,0.6"},
                          {"splashes", "2"},   {"rate", "20"},        {"wind", "2,1"},
                          {"opacity", "4"},    {"seed", "2"},         {"shutter", "90"},
                          {"focus", "4"},      {"fov", "50"},         {"sky", "2"},
                          {"env-gain", "1.5"}, {"env-order", "20"},   {"ground", "1.8,2"},
                          {"fog", "0.01"},     {"fog-distance", "80"}};

ImageF plateOf(const Options& o)
{
    ImageF plate(o.width, o.height, 4, 1.0f);
    for (int y = 0; y < o.height; ++y)
        for (int x = 0; x < o.width; ++x)
            for (int c = 0; c < 3; ++c)
                plate.at(x, y, c) = y < o.height / 2 ? 0.8f - 0.05f * float(c) : 0.02f + 0.01f * float(x / 16 % 8);
    return plate;
}

double medianOf(std::vector<double> values)
{
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
}

void measure(const Options& o)
{
    const ImageF plate = plateOf(o);
    shot::PlateSamples samples;
    samples.forLight.push_back({0, plate});
    const shot::Shot shot{o.width, o.height, 24, 0};
    const shot::CompositorOptions how{.device = o.device, .changes = true};
    shot::Settings settings;
    settings.rate_mm_h = 25;
    settings.ground = "1.6";
    shot::Compositor live(settings, shot, how, samples);
    const auto render = [&](shot::Compositor& compositor) {
        io::PlateFrame frame;
        frame.number = 12;
        frame.pixels = plate;
        return compositor.render(std::move(frame));
    };
    render(live);
    fmt::print("{}x{}, {}, ms: change, frame, both; a shot made anew and its frame\n", o.width, o.height,
               live.statistics().device);
    for (const Move& move : moves) {
        if (!o.only.empty() && o.only != move.parameter) continue;
        shot::Settings moved = settings;
        shot::setFromText(moved, shot::findParameter(move.parameter), move.text);
        std::vector<double> change, frame, both, anew;
        for (int i = 0; i < 2 * o.rounds; ++i) {
            const shot::Settings& next = i % 2 == 0 ? moved : settings;
            const Timer clock;
            live.change(next);
            change.push_back(clock.milliseconds());
            render(live);
            both.push_back(clock.milliseconds());
            frame.push_back(both.back() - change.back());
        }
        for (int i = 0; i < std::max(1, o.rounds / 2); ++i) {
            const Timer clock;
            shot::Compositor fresh(moved, shot, how, samples);
            render(fresh);
            anew.push_back(clock.milliseconds());
        }
        fmt::print("{:<14} {:8.2f} {:8.2f} {:8.2f} {:8.1f}\n", move.parameter, medianOf(change), medianOf(frame),
                   medianOf(both), medianOf(anew));
    }
}

}  // namespace

int main(int argc, char** argv)
try {
    Options options;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i], value = argv[i + 1];
        if (flag == "--device")
            options.device = value;
        else if (flag == "--only")
            options.only = value;
        else if (flag == "--rounds")
            options.rounds = std::max(1, std::atoi(value.c_str()));
        else if (flag == "--size" && std::sscanf(value.c_str(), "%dx%d", &options.width, &options.height) == 2)
            continue;
        else
            throw Error(ErrorCode::InvalidArgument, "'{}' is no flag; see the top of bench/change_bench.cpp", flag);
    }
    measure(options);
} catch (const virga::Error& error) {
    fmt::print(stderr, "bench_change: {}\n", error.what());
    return virga::exitCode(error.code());
}
