#include "SkipCosts.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>

#include "core/Timer.h"
#include "io/Plate.h"
#include "shot/Compositor.h"

namespace bench {
namespace {

using namespace virga;
using shot::Settings;
using shot::Skips;

/// Files that the scenes are made of, gone with it.
class Folder {
public:
    Folder() : path_(std::filesystem::temp_directory_path() / fmt::format("virga-bench-skip-{}", getpid()))
    {
        std::filesystem::create_directories(path_);
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    std::string lamps(double distance) const
    {
        const std::string name = path_ / "lamps.toml";
        std::ofstream file(name);
        for (int i = 0; i < 8; ++i)
            file << fmt::format("[[light]]\nposition = [{}, 3, {}]\nintensity = [1.2, 0.9, 0.5]\n", 2 * i - 7,
                                i < 4 ? -distance : distance);
        return name;
    }
    /// A wall of so many metres; with a door to the sky where it is a wall.
    std::string depth(int width, int height, float metres) const
    {
        ImageF image(width, height, 1, metres);
        for (int y = height / 5; y < height; ++y)
            for (int x = 2 * width / 5; x < 3 * width / 5; ++x) image.at(x, y) = std::numeric_limits<float>::infinity();
        const std::string name = path_ / "depth.exr";
        io::writeExr(name, image, {"Z"}, false);
        return name;
    }

private:
    std::filesystem::path path_;
};

struct Scene {
    const char* name = "";
    std::function<void(Settings&, const Folder&, const SkipBenchOptions&)> set;
    bool plateStands = false;
    double share = 0;  ///< of a frame's sides that is asked for; 0: nobody asks for a part
};

struct Case {
    const char* name;
    bool Skips::*skip;  ///< null: what is outside of the region of interest
    Scene has, hasNot;
};

/// Rain alone, as much as a shot shows.
Settings rainAlone()
{
    Settings s;
    s.darken = s.desaturate = 0;
    s.fog_1_m = 0;
    s.splashes = 0;
    s.strokes = 80000;
    return s;
}

/// A region lit by its frame's whole plate would have to read all of that.
Settings asIsWithSamples()
{
    Settings s;
    s.rate_mm_h = 25;
    s.fogColor = {0.5, 0.5, 0.55};
    return s;
}

const Case cases[] = {
    {"cells behind the depth",
     &Skips::behindDepth,
     {"25 mm/h, --threshold 0.003, walls at 3 m",
      [](Settings& s, const Folder& f, const SkipBenchOptions& o) {
          s.strokes.reset();
          s.threshold = 0.003;
          s.depth = f.depth(o.width, o.height, 3);
      }},
     {"sky everywhere",
      [](Settings& s, const Folder& f, const SkipBenchOptions& o) {
          s.depth = f.depth(o.width, o.height, std::numeric_limits<float>::infinity());
      }}},
    {"cells out of view",
     &Skips::outOfView,
     {"a view of 60 degrees, 25 mm/h", [](Settings& s, const Folder&, const SkipBenchOptions&) { s.strokes.reset(); }},
     {}},
    {"cells under the threshold",
     &Skips::faint,
     {"25 mm/h, --far 30",
      [](Settings& s, const Folder&, const SkipBenchOptions&) { s.strokes.reset(), s.far_m = 30; }},
     {"25 mm/h, --far 3", [](Settings& s, const Folder&, const SkipBenchOptions&) { s.strokes.reset(), s.far_m = 3; }}},
    {"passes and parts of shaders",
     &Skips::passes,
     {"80,000 strokes, nothing else", [](Settings&, const Folder&, const SkipBenchOptions&) {}},
     {"no strokes are idle",
      [](Settings& s, const Folder& f, const SkipBenchOptions& o) {
          s.darken = 0.1;
          s.fog_1_m = 0.01;
          s.blur_px = 1;
          s.backgroundBoost = 0.3;
          s.splashes = 1;
          s.lights = f.lamps(10);
          s.depth = f.depth(o.width, o.height, 30);
      }}},
    {"lamps that reach nothing",
     &Skips::farLamps,
     {"8 lamps, 5 km away", [](Settings& s, const Folder& f, const SkipBenchOptions&) { s.lights = f.lamps(5000); }},
     {"8 lamps, 10 m away", [](Settings& s, const Folder& f, const SkipBenchOptions&) { s.lights = f.lamps(10); }}},
    {"a plate that does not change",
     &Skips::unchanged,
     {"a still, its light from each frame", [](Settings&, const Folder&, const SkipBenchOptions&) {}, true},
     {"a plate that moves", [](Settings&, const Folder&, const SkipBenchOptions&) {}}},
    {"what is outside of the region",
     nullptr,
     {"a quarter of each side, 25 mm/h, the defaults",
      [](Settings& s, const Folder&, const SkipBenchOptions&) { s = asIsWithSamples(); }, false, 0.25},
     {"all of the frame, as a region",
      [](Settings& s, const Folder&, const SkipBenchOptions&) { s = asIsWithSamples(); }, false, 1}},
};

/// In the middle of the frame.
Window regionOf(const SkipBenchOptions& options, double share)
{
    const int width = int(options.width * share), height = int(options.height * share);
    return {(options.width - width) / 2, (options.height - height) / 2, width, height};
}

io::PlateFrame plateOf(const SkipBenchOptions& options, FrameNumber number, bool stands)
{
    io::PlateFrame plate;
    plate.number = number;
    plate.content = stands ? 1 : std::uint64_t(number) + 1;
    plate.pixels = ImageF(options.width, options.height, 4, 1.0f);
    const int shift = stands ? 0 : int(number);
    for (int y = 0; y < options.height; ++y)
        for (int x = 0; x < options.width; ++x)
            for (int c = 0; c < 3; ++c)
                plate.pixels.at(x, y, c) =
                    y < options.height / 2 ? 0.8f - 0.05f * float(c) : 0.02f + 0.01f * float((x + shift) / 16 % 8);
    return plate;
}

double processorSeconds()
{
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Median and mean of a frame [ms], and the frames.
std::vector<ImageF> timed(const Settings& settings, const SkipBenchOptions& options, const Scene& scene,
                          const Skips& skips, const shot::View& view, double& median_ms, double& all_ms)
{
    shot::PlateSamples samples;
    if (scene.share > 0) samples.forLight.push_back({0, plateOf(options, 0, true).pixels});
    shot::Compositor compositor(settings, {options.width, options.height, 24, 0},
                                {.wanted = {.skips = skips}, .device = options.device}, samples);
    std::vector<ImageF> pictures;
    std::vector<double> times;
    double all = 0;
    for (int i = 0; i < options.frames + 1; ++i) {
        io::PlateFrame plate = plateOf(options, i, scene.plateStands);
        const double before = processorSeconds();
        const Timer timer;
        pictures.push_back(compositor.render(std::move(plate), view, {}).beauty);
        if (i == 0) continue;  // it allocates
        times.push_back(timer.milliseconds());
        all += processorSeconds() - before;
    }
    std::nth_element(times.begin(), times.begin() + std::ptrdiff_t(times.size() / 2), times.end());
    median_ms = times[times.size() / 2];
    all_ms = 1e3 * all / double(times.size());
    return pictures;
}

SkipTime timesOf(const Scene& scene, bool Skips::*skip, const SkipBenchOptions& options)
{
    SkipTime result;
    if (!scene.set) return result;
    const Folder folder;
    Settings settings = rainAlone();
    scene.set(settings, folder, options);
    Skips skips;
    shot::View part;
    if (skip == nullptr) part.region = regionOf(options, scene.share);
    const auto with = timed(settings, options, scene, skips, part, result.with_ms, result.withAll_ms);
    if (skip != nullptr) skips.*skip = false;
    auto without = timed(settings, options, scene, skips, {}, result.without_ms, result.withoutAll_ms);
    if (skip == nullptr)
        for (ImageF& whole : without)
            whole = shot::placed(std::move(whole), {0, 0, options.width, options.height}, part.region);
    for (std::size_t frame = 0; frame < with.size(); ++frame)
        for (std::size_t i = 0; i < with[frame].size(); ++i)
            result.difference =
                std::max(result.difference, std::abs(double(with[frame].data()[i]) - double(without[frame].data()[i])));
    return result;
}

}  // namespace

std::vector<SkipCost> measureSkips(const SkipBenchOptions& options, const std::function<void(const SkipCost&)>& done)
{
    std::vector<SkipCost> costs;
    for (const Case& test : cases) {
        if (std::string(test.name).find(options.only) == std::string::npos) continue;
        SkipCost cost{test.name, test.has.name, test.hasNot.name, timesOf(test.has, test.skip, options),
                      timesOf(test.hasNot, test.skip, options)};
        done(cost);
        costs.push_back(std::move(cost));
    }
    return costs;
}

}  // namespace bench
