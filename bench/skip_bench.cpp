// What is saved by what is skipped, and what finding out costs (docs/skipping.md).
//   bench_skip [--device cpu|gpu|auto|N] [--size WIDTHxHEIGHT] [--frames N] [--only NAME] [--csv]
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "SkipCosts.h"
#include "core/Error.h"

namespace {

void print(const char* scene, const bench::SkipTime& t, bool asCsv, const std::string& name)
{
    if (asCsv)
        fmt::print("{},\"{}\",{:.3f},{:.3f},{:.3f},{:.3f},{:.3g}\n", name, scene, t.with_ms, t.without_ms, t.withAll_ms,
                   t.withoutAll_ms, t.difference);
    else
        fmt::print("  {:<36} {:8.2f} {:8.2f} {:9.2f} {:9.2f} {:10.2g}\n", scene, t.with_ms, t.without_ms, t.withAll_ms,
                   t.withoutAll_ms, t.difference);
}

}  // namespace

int main(int argc, char** argv)
try {
    bench::SkipBenchOptions options;
    bool asCsv = false;
    for (int i = 1; i < argc; ++i) {
        const std::string flag = argv[i];
        const bool hasValue = i + 1 < argc;
        if (flag == "--csv")
            asCsv = true;
        else if (flag == "--device" && hasValue)
            options.device = argv[++i];
        else if (flag == "--only" && hasValue)
            options.only = argv[++i];
        else if (flag == "--frames" && hasValue)
            options.frames = std::max(1, std::atoi(argv[++i]));
        else if (flag == "--size" && hasValue &&
                 std::sscanf(argv[++i], "%dx%d", &options.width, &options.height) == 2 && options.width > 0 &&
                 options.height > 0)
            continue;
        else {
            fmt::print(stderr, "bench_skip: '{}' is no flag, or lacks its value; see the top of bench/skip_bench.cpp\n",
                       flag);
            return 2;
        }
    }
    if (asCsv)
        fmt::print("skip,scene,with_ms,without_ms,with_all_ms,without_all_ms,difference\n");
    else
        fmt::print("{}x{}, device {}, ms a frame: skipped, not skipped; all processors': the same\n", options.width,
                   options.height, options.device);
    bench::measureSkips(options, [&](const bench::SkipCost& cost) {
        if (!asCsv) fmt::print("{}\n", cost.name);
        print(cost.scene.c_str(), cost.has, asCsv, cost.name);
        if (!cost.otherScene.empty()) print(cost.otherScene.c_str(), cost.hasNot, asCsv, cost.name);
        std::fflush(stdout);
    });
} catch (const virga::Error& error) {
    fmt::print(stderr, "bench_skip: {}\n", error.what());
    return virga::exitCode(error.code());
}
