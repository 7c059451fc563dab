// What a host of the library waits for: its first shot, a second one, the next frame, the same again, a slider moved, a
// region, and what formats cost.
//   bench_library [--device auto|cpu|gpu|N] [--size 960x540] [--laps 15]
// Milliseconds that pass, median and the slowest of twenty; beside them time of all processors, which a busy machine
// does not stretch. On 25 mm/h over a ground with fog, splashes and darkening, lit by samples of the plate. Frames that
// the disk's cache knows are not asked for: XDG_CACHE_HOME is a folder of its own that goes with the program.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "virga/virga.h"

namespace {

struct Options {
    std::string device = "auto";
    int width = 960, height = 540, laps = 15;
};

[[noreturn]] void fail()
{
    fmt::print(stderr, "bench_library: {}\n", virga_error_sentence());
    std::exit(1);
}
void check(virga_error code)
{
    if (code != VIRGA_OK) fail();
}

double counted(const char* name)
{
    std::uint64_t value = 0;
    check(virga_counter(name, &value));
    return double(value);
}

double processorSeconds() { return double(std::clock()) / CLOCKS_PER_SEC; }

/// A line of the table.
void report(const std::string& name, std::vector<double> wall_ms, double processors_ms)
{
    std::sort(wall_ms.begin(), wall_ms.end());
    const auto at = [&](double share) {
        return wall_ms[std::min(wall_ms.size() - 1, std::size_t(share * double(wall_ms.size())))];
    };
    fmt::print("{:44} {:9.2f} {:9.2f} {:12.2f}\n", name, at(0.5), at(0.95), processors_ms / double(wall_ms.size()));
}

void measure(const std::string& name, int laps, const std::function<void(int)>& work)
{
    using Clock = std::chrono::steady_clock;
    std::vector<double> wall;
    double processors = 0;
    for (int lap = 0; lap < laps; ++lap) {
        const auto begin = Clock::now();
        const double before = processorSeconds();
        work(lap);
        processors += 1e3 * (processorSeconds() - before);
        wall.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    report(name, wall, processors);
}

class Host {
public:
    explicit Host(const Options& o)
        : o_(o), pixels_(4 * std::size_t(o.width) * std::size_t(o.height)), result_(pixels_.size())
    {
        for (std::size_t i = 0; i < pixels_.size(); ++i)
            pixels_[i] = i % 4 == 3 ? 1.0f : 0.1f + 0.5f * float(i / 4 % std::size_t(o.width)) / float(o.width);
    }
    virga_shot* newShot() const
    {
        virga_shot* shot = nullptr;
        check(virga_shot_create(o_.width, o_.height, 24, &shot));
        check(virga_shot_set_device(shot, o_.device.c_str()));
        check(virga_shot_set(shot, "ground", "1.6,4"));
        virga_picture plate = picture(pixels_.data());
        check(virga_shot_add_plate_sample(shot, 0, &plate));
        return shot;
    }
    void frame(virga_shot* shot, int number, const std::function<void(virga_request&)>& ask = {})
    {
        virga_picture plate = picture(pixels_.data()), beauty = picture(result_.data());
        virga_request request = virga_request_default();
        request.frame = number;
        request.plate = &plate;
        request.beauty = &beauty;
        if (ask) ask(request);
        check(virga_shot_render(shot, &request));
    }
    static virga_picture picture(const void* pixels)
    {
        virga_picture described = virga_picture_default();
        described.planes[0] = const_cast<void*>(pixels);
        return described;
    }

private:
    const Options o_;
    std::vector<float> pixels_, result_;
};

void run(const Options& o)
{
    Host host(o);
    virga_shot* stays = nullptr;
    measure("first shot and its first frame", 1, [&](int) { host.frame(stays = host.newShot(), 0); });
    const char* device = nullptr;
    check(virga_shot_device(stays, &device));
    const std::string drawnBy = device;
    const double contexts = counted("contexts"), programs = counted("programs"), environments = counted("environments");
    measure("another shot and its first frame", o.laps, [&](int lap) {
        virga_shot* shot = host.newShot();
        host.frame(shot, lap);
        virga_shot_release(shot);
    });
    fmt::print("    contexts opened {}, programs compiled {}, environments made {}\n", counted("contexts") - contexts,
               counted("programs") - programs, counted("environments") - environments);
    measure("next frame", o.laps, [&](int lap) { host.frame(stays, lap); });
    measure("the same frame, same plate_content", o.laps,
            [&](int) { host.frame(stays, 5, [](virga_request& request) { request.plate_content = 1; }); });
    for (const auto& [name, values] : {std::pair{"darken", std::pair{"0.2", "0.3"}},
                                       {"wind", {"1,0", "2,0"}},
                                       {"rate", {"20", "30"}},
                                       {"env-gain", {"1", "1.1"}},
                                       {"seed", {"1", "2"}}})
        measure(fmt::format("one slider moved: {}", name), o.laps, [&, n = name, v = values](int lap) {
            check(virga_shot_set(stays, n, lap % 2 == 0 ? v.first : v.second));
            host.frame(stays, 5);
        });
    measure("a quarter of the frame", o.laps, [&](int lap) {
        host.frame(stays, lap, [&](virga_request& r) {
            r.region = {o.width / 4, o.height / 4, o.width / 2, o.height / 2};
        });
    });
    std::vector<std::uint8_t> codes(3 * std::size_t(o.width) * std::size_t(o.height), 90);
    virga_picture yuv = virga_picture_default();
    yuv.layout = VIRGA_YUV420;
    yuv.samples = VIRGA_UINT8;
    yuv.color_space = "sRGB";
    std::size_t at = 0;
    for (int k = 0; k < 3; ++k) {
        yuv.planes[k] = codes.data() + at;
        at += std::size_t(o.width) * std::size_t(o.height) / (k == 0 ? 1 : 4);
    }
    measure("next frame, 8-bit 4:2:0 in and out", o.laps, [&](int lap) {
        host.frame(stays, lap, [&](virga_request& request) { request.plate = request.beauty = &yuv; });
    });
    virga_shot_release(stays);
    fmt::print("drawn by {}\n", drawnBy);
}

}  // namespace

int main(int argc, char** argv)
{
    Options o;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--device") o.device = argv[i + 1];
        if (flag == "--laps") o.laps = std::max(1, std::atoi(argv[i + 1]));
        if (flag == "--size" && std::sscanf(argv[i + 1], "%dx%d", &o.width, &o.height) != 2) {
            fmt::print(stderr, "bench_library: --size '{}': must be WIDTHxHEIGHT\n", argv[i + 1]);
            return 2;
        }
    }
    const auto cache = std::filesystem::temp_directory_path() / fmt::format("virga-bench-{}", getpid());
    setenv("XDG_CACHE_HOME", cache.c_str(), 1);
    fmt::print("{}x{}, device {}\n{:44} {:>9} {:>9} {:>12}\n", o.width, o.height, o.device, "milliseconds", "median",
               "p95", "processors");
    run(o);
    std::filesystem::remove_all(cache);
}
