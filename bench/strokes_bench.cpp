// Frame times of the stroke renderer: drops to picture, on this machine's device.
//   bench_strokes [--device auto|cpu|gpu|N] [--frames N] [--only CASE] [--drops-per-cell N] [--shaders DIR] [--write
//   FILE.ppm]
// Prints the machine, then a line a case; GPU time by timer queries, read-back and list building apart, and the time of
// all processors together, which a busy machine does not stretch.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/Timer.h"
#include "gl/Context.h"
#include "gl/PassTimer.h"
#include "matte/OscillatingDrops.h"
#include "particles/RainField.h"
#include "passes/BlurPass.h"
#include "passes/CompositePass.h"
#include "passes/CpuRenderer.h"
#include "passes/LightPass.h"
#include "passes/SplashPass.h"
#include "passes/StrokePass.h"

namespace {

using namespace virga;

struct Case {
    const char* name;
    int width, height;
    double
        strokes;  ///< 0: as `virga rain` draws 25 mm/h by itself, thinned out, with fog and darkening; -1: nearStroke()
    double exposure_s;
    bool light;               ///< fog and depth too
    bool everything = false;  ///< and splashes, blur, grade, boost, lamps, layers, depth and motion of strokes
};

double median(std::vector<double> values)
{
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

void writePicture(const std::string& path, const ImageF& image)
{
    std::ofstream file(path, std::ios::binary);
    file << "P6\n" << image.width() << " " << image.height() << "\n255\n";
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                const float v = std::clamp(image.at(x, y, c), 0.0f, 1.0f);
                file.put(char(std::lround(255 * std::pow(v, 1 / 2.2f))));
            }
}

constexpr double defaultOpacity = 5;

/// What of the rain is drawn: all strokes over a threshold, or what `virga rain` draws by itself.
particles::Visibility visibilityOf(const Case& c)
{
    if (c.strokes < 0) return {.near_m = 0.01, .far_m = 500, .threshold = 0.002};
    if (c.strokes > 0) return {.near_m = 0.5, .far_m = 500, .threshold = 0.002};
    return {.near_m = 0.8, .far_m = 200, .threshold = 0.02 / defaultOpacity, .thin = 0.08 / defaultOpacity};
}

/// One drop right before the lens: a stroke of 330 by 1,400 pixels, the height of a picture.
particles::CellList nearStroke()
{
    particles::CellList list;
    list.classes.push_back({{6e-3f, 6.001e-3f, 1000, 0}, {0, -0.02f, 0, 4}, glm::vec4(0.0f)});
    list.cells.push_back({{1, 2, 0, 0}, {0, 0.01f, -0.02f, 0}, glm::vec4(0.0f)});
    list.blocks = {0};
    list.drops = 1;
    return list;
}

double cpuSeconds()
{
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

struct Options {
    std::string device = "auto", picture, only, shaders;
    int frames = 20;
    double dropsPerCell = 0;  // 0: RainField::dropsPerCellFor
};

/// A road 1.6 m under the camera, the sky above it.
ImageF groundDepth(int width, int height, float focal_px)
{
    ImageF depth(width, height, 1, std::numeric_limits<float>::infinity());
    for (int y = height / 2 + 1; y < height; ++y)
        for (int x = 0; x < width; ++x) depth.at(x, y) = 1.6f * focal_px / (float(y) + 0.5f - 0.5f * float(height));
    return depth;
}

/// Constants that only the passes of `everything` read: a medium rain's splashes, a lamp, a grade, a blur of 2 px.
void describeEverything(shared::FrameConstants& constants, const Case& c)
{
    constants.boost = {0.3f, 0, 0.1f, constants.lens.x};
    constants.grade = {0.1f, 0.2f, 2, 50};
    constants.splash = {3, 0.12f, 1, 0.4f};
    constants.splashGrid = {0.1f, 0, 0, 1};
    constants.splashKey = {1, 0, 0, std::uint32_t(passes::SplashPass::capacity(c.width, c.height))};
    constants.splashTime = {7, 12, 0, 0};
    constants.splashDrop = {1e-3f, 8e-3f, 2000, 60};
    constants.lights.x = 1;
    constants.medium.x = 0.005f;  // the veil is of thinned strokes, which there are none of
    constants.lut = {0.02f, 1, 33, 0};
}

shared::FrameConstants constantsOf(const Case& c, const particles::Exposure& exposure,
                                   const particles::Visibility& visibility)
{
    const bool isDefault = c.strokes == 0;
    shared::FrameConstants constants{};
    constants.cameraFromWorldOpen = constants.cameraFromWorldClose = glm::mat4(1.0f);
    const float focal = float(exposure.projection.focal_px);
    constants.lens = {focal, focal, 0.5f * float(c.width), 0.5f * float(c.height)};
    constants.boost.w = focal;
    constants.range = {float(visibility.near_m), float(visibility.far_m), float(visibility.threshold),
                       isDefault ? float(defaultOpacity) : 1.0f};
    constants.focus = {0.0f, 0.1f, float(exposure.duration_s), 20.0f};
    constants.medium = {0, float(visibility.thin), 0.05f, 0.04f};
    if (isDefault) constants.grade = {0.2f, 0.3f, 0, 50};
    constants.picture = {c.width, c.height, 0, 0};
    if (c.everything) describeEverything(constants, c);
    return constants;
}

/// The same without OpenGL, where that can draw it.
void runOnCpu(const Case& c, const Options& options, const passes::Features& features,
              const particles::RainField& field, particles::Exposure exposure, const particles::Visibility& visibility)
{
    passes::CpuRenderer renderer(c.width, c.height, features, matte::makeOscillatingDropAtlas(1));
    const ImageF depth = groundDepth(c.width, c.height, float(exposure.projection.focal_px)), white(64, 32, 3, 0.9f);
    renderer.setDepth(depth);
    renderer.setFogTable(std::vector<float>(256, 0.05f));
    renderer.setDropRadiance(white, white);
    renderer.setRingTransfer(std::vector<float>(3 * 256, 0.1f));
    const shared::PointLight lamp{{1, 1, -6, 0.1f}, {2, 1, 0.5f, 0}};
    renderer.setLamps({&lamp, 1});
    renderer.setLut(std::vector<float>(3 * 33 * 33 * 33, 0.01f));
    std::map<std::string, std::vector<double>> times;
    double cpu = 0;
    ImageF beauty;
    for (int f = 0; f < options.frames + 2; ++f) {
        if (f == 2) cpu = cpuSeconds();
        exposure.open_s = f / 24.0;
        const Timer list;
        const particles::CellList cells = c.strokes < 0 ? nearStroke() : field.cellsInView(exposure, visibility);
        const double list_ms = list.milliseconds();
        beauty = ImageF(c.width, c.height, 4, 0.05f);
        const Timer all;
        renderer.render(beauty, constantsOf(c, exposure, visibility), cells);
        if (f < 2) continue;
        for (const auto& [name, ms] : renderer.passMs()) times[name].push_back(ms);
        times["all"].push_back(all.milliseconds() + list_ms);
        times["cells"].push_back(list_ms);
    }
    if (!options.picture.empty()) writePicture(options.picture + ".cpu.ppm", beauty);
    std::printf("%-34s strokes %8zu |", (std::string(c.name) + " without GL").c_str(), renderer.strokeCount());
    for (const auto& [name, values] : times) std::printf(" %s %.2f ms", name.c_str(), median(values));
    std::printf(" | all processors %.1f ms a frame\n", 1e3 * (cpuSeconds() - cpu) / options.frames);
}

void run(const Case& c, const gl::Context& context, const Options& options)
{
    if (!options.only.empty() && options.only != c.name) return;
    const int frames = options.frames;
    const rainfall::DropSizes sizes(25);
    const particles::Motion motion({.wind = {0.8, 0.0}, .gust = 0.3, .turbulence = 0.25});
    particles::Exposure exposure;
    exposure.duration_s = c.exposure_s;
    exposure.projection = camera::projectionFromHorizontalFov(c.width, c.height, 60 * 3.14159265 / 180);
    particles::Visibility visibility = visibilityOf(c);

    const double few =
        options.dropsPerCell > 0 ? options.dropsPerCell : particles::RainField::dropsPerCellFor(c.strokes);
    const particles::RainField plain(rainfall::makeSizeClasses(sizes), sizes.slope(), motion, 1, 1, few);
    visibility.thin = plain.thinnableTo(exposure.projection.focal_px, exposure.duration_s, visibility);
    const double expected = plain.expectedStrokes(exposure.projection, exposure.duration_s, visibility);
    const particles::RainField field = c.strokes > 0
                                           ? particles::RainField(rainfall::makeSizeClasses(sizes), sizes.slope(),
                                                                  motion, 1, c.strokes / expected, few)
                                           : plain;

    passes::Features features;
    features.rain = true;
    features.software = context.device().isSoftware;
    features.fog = features.depth = c.light;
    if (c.strokes == 0) features.fog = features.darken = features.veil = true;
    if (c.everything)
        features.splashes = features.blur = features.darken = features.colorTransfer = features.boost =
            features.lights = features.layers = features.nearest = features.cameraMotion = true;
    passes::FrameTargets targets(c.width, c.height, features);
    passes::StrokePass strokes(features, matte::makeOscillatingDropAtlas(1), options.shaders);
    const passes::LightPass light(features, options.shaders);
    const passes::CompositePass composite(features, options.shaders);
    std::optional<passes::SplashPass> splashes;
    std::optional<passes::BlurPass> blur;
    if (features.splashes) splashes.emplace(features, options.shaders);
    if (features.blur) blur.emplace(features, options.shaders);
    if (features.lights) {
        targets.uploadRingTransfer(std::vector<float>(3 * 256, 0.1f));
        const shared::PointLight lamp{{1, 1, -6, 0.1f}, {2, 1, 0.5f, 0}};
        targets.uploadLights({&lamp, 1});
    }
    if (features.colorTransfer) targets.uploadLut(33, std::vector<float>(3 * 33 * 33 * 33, 0.01f));

    ImageF plate(c.width, c.height, 4, 0.05f),
        depth = groundDepth(c.width, c.height, float(exposure.projection.focal_px)), white(64, 32, 3, 0.9f);
    targets.uploadPlate(plate);
    if (c.light) targets.uploadDepth(depth);
    if (features.fog) targets.uploadFogTable(std::vector<float>(256, 0.05f));
    targets.uploadDropRadiance(white, white);

    gl::PassTimer timer;
    std::map<std::string, std::vector<double>> times;
    std::size_t drawn = 0, listed = 0, cellCount = 0;
    double cpu = 0;
    for (int f = 0; f < frames + 2; ++f) {
        if (f == 2) cpu = cpuSeconds();
        exposure.open_s = f / 24.0;
        Timer list;
        const particles::CellList cells = c.strokes < 0 ? nearStroke() : field.cellsInView(exposure, visibility);
        const double list_ms = list.milliseconds();

        shared::FrameConstants constants = constantsOf(c, exposure, visibility);
        strokes.describe(constants, cells);
        targets.setConstants(constants);
        targets.bind();
        timer.begin();
        light.run(targets);
        timer.mark("light");
        if (blur) {
            blur->run(targets);
            timer.mark("blur");
        }
        if (splashes) {
            splashes->run(targets);
            timer.mark("splashes");
        }
        strokes.run(targets, cells, timer);
        composite.run(targets);
        timer.mark("composite");
        Timer read;
        const auto gpu = timer.collect();
        const double gpuWait = read.milliseconds();
        read.restart();
        const ImageF beauty = targets.readBeauty();
        if (f >= 2) {  // the first two compile and warm up
            for (const auto& [name, ms] : gpu) times[name].push_back(ms);
            times["cells"].push_back(list_ms);
            times["read-back"].push_back(read.milliseconds());
            times["wait"].push_back(gpuWait);
        }
        drawn = strokes.strokeCount();
        listed = cells.drops;
        cellCount = cells.cells.size();
        if (f == frames + 1 && !options.picture.empty()) writePicture(options.picture, beauty);
    }
    std::printf("%-34s strokes %8zu of %8zu drops in %zu cells |", c.name, drawn, listed, cellCount);
    for (const auto& [name, values] : times) std::printf(" %s %.2f ms", name.c_str(), median(values));
    std::printf(" | all processors %.1f ms a frame\n", 1e3 * (cpuSeconds() - cpu) / frames);
    runOnCpu(c, options, features, field, exposure, visibility);
}

}  // namespace

int main(int argc, char** argv)
try {
    Options options;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--device") options.device = argv[i + 1];
        if (flag == "--frames") options.frames = std::max(1, std::atoi(argv[i + 1]));
        if (flag == "--only") options.only = argv[i + 1];
        if (flag == "--drops-per-cell") options.dropsPerCell = std::atof(argv[i + 1]);
        if (flag == "--shaders") options.shaders = argv[i + 1];
        if (flag == "--write") options.picture = argv[i + 1];
    }
    const gl::Context context(options.device);
    std::printf("%s, OpenGL %s\n", context.device().renderer.c_str(), context.device().version.c_str());
    run({"80k.720x480.1/200s", 720, 480, 80e3, 1 / 200.0, false}, context, options);
    run({"80k.720x480.1/48s", 720, 480, 80e3, 1 / 48.0, false}, context, options);
    run({"80k.720x480.1/200s.fog+depth", 720, 480, 80e3, 1 / 200.0, true}, context, options);
    run({"80k.720x480.1/200s.everything", 720, 480, 80e3, 1 / 200.0, true, true}, context, options);
    run({"300k.1920x1080.1/200s.fog+depth", 1920, 1080, 300e3, 1 / 200.0, true}, context, options);
    run({"near.1280x1024", 1280, 1024, -1, 1 / 200.0, true}, context, options);
    run({"25mm_h.1920x1080.1/200s", 1920, 1080, 0, 1 / 200.0, false}, context, options);
    if (!context.device().isSoftware || !options.only.empty())
        run({"5M.1280x1024.1/200s.fog+depth", 1280, 1024, 5e6, 1 / 200.0, true}, context, options);
    return 0;
} catch (const virga::Error& error) {
    std::fprintf(stderr, "bench_strokes: %s\n", error.what());
    return virga::exitCode(error.code());
}
