// Error against order of the light that drops return, beside the time that baking takes.
//   bench_light [--hdri FOLDER] [--csv FILE] [--plot SVG] [--only NAME] [--orders a,b,...] [--grid PIXELS]
// Environments: the analytic ones of the reference tables (cosine lobe, sun and sky) and every .exr in FOLDER. Truth:
// each pixel times D, tests/reference/DropLight.h. Prints a Markdown table and writes a row for each case:
//   env,mode,order,lights,remainder,rms_exact,max_exact,rms_map,max_map,rms_grid,max_grid,ms
// Errors over the mean radiance; `exact` the sums in double precision, `map` the baked map, `grid` what the picture
// interpolates from the map (960 x 540, field of view 60 degrees; --grid: another step than its own). order -1 is auto.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "core/Error.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "environment/DropRadiance.h"
#include "environment/Panorama.h"
#include "io/Plate.h"
#include "plot/Chart.h"
#include "reference/DropLight.h"
#include "sh/Panorama.h"

namespace {

using namespace virga;
using environment::DropRadiance;
using environment::DropRadianceBaker;
using environment::DropRadianceOptions;
using std::numbers::pi;

/// Pixels seen by cameras that look anywhere: where the picture needs the light.
struct View {
    glm::dmat3 worldFromCamera;
    glm::dvec2 pixel;
    glm::dvec3 direction;
};
constexpr int pictureWidth = 960, pictureHeight = 540;
const double focal_px = 0.5 * pictureWidth / std::tan(pi / 6);

glm::dvec3 ray(const glm::dmat3& worldFromCamera, const glm::dvec2& pixel)
{
    return glm::normalize(worldFromCamera *
                          glm::dvec3(pixel.x - 0.5 * pictureWidth, 0.5 * pictureHeight - pixel.y, -focal_px));
}

/// The fractional parts of multiples of irrational numbers cover evenly and are the same on every machine.
double spread(int i, double step) { return std::fmod((i + 0.5) * step, 1.0); }

std::vector<View> someViews()
{
    std::vector<View> views;
    for (int camera = 0; camera < 60; ++camera) {
        // Shoemake 1992: uniform rotations.
        const double u = spread(camera, 0.8191725134), a = 2 * pi * spread(camera, 0.6710436067),
                     b = 2 * pi * spread(camera, 0.5497004779);
        const glm::dquat q(std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b),
                           std::sqrt(u) * std::cos(b));
        const glm::dmat3 worldFromCamera = glm::mat3_cast(q);
        for (int i = 0; i < 25; ++i) {
            const int n = camera * 25 + i;
            const glm::dvec2 pixel(spread(n, 0.7548776662) * pictureWidth, spread(n, 0.5698402910) * pictureHeight);
            views.push_back({worldFromCamera, pixel, ray(worldFromCamera, pixel)});
        }
    }
    return views;
}

/// As passes::FrameTargets chooses it.
int gridStepFor(const ImageF& map)
{
    int step = 16;
    while (step > 4 && step / focal_px > 2 * pi / map.width()) step /= 2;
    return step;
}

/// As pass_light.comp and pass_composite.comp do it.
glm::dvec3 throughGrid(const ImageF& map, const View& view, int step)
{
    const glm::dvec2 place = view.pixel / double(step), corner = glm::floor(place), t = place - corner;
    const auto node = [&](double x, double y) {
        return environment::sampleMap(map, ray(view.worldFromCamera, (corner + glm::dvec2(x, y)) * double(step)));
    };
    return (1 - t.y) * ((1 - t.x) * node(0, 0) + t.x * node(1, 0)) + t.y * ((1 - t.x) * node(0, 1) + t.x * node(1, 1));
}

struct Deviation {
    double square = 0, largest = 0;
    std::size_t count = 0;
    void add(const glm::dvec3& found, const glm::dvec3& truth)
    {
        for (int c = 0; c < 3; ++c) {
            square += (found[c] - truth[c]) * (found[c] - truth[c]);
            largest = std::max(largest, std::abs(found[c] - truth[c]));
        }
        count += 3;
    }
    double rms() const { return std::sqrt(square / double(count)); }
};

struct Environment {
    std::string name;
    environment::Panorama panorama;
};

/// Pixels are means of 8 x 8 samples.
template <class F>
environment::Panorama paint(int width, int height, F&& radiance)
{
    environment::Panorama result{ImageF(width, height, 3)};
    constexpr int fine = 8;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            double sum = 0;
            for (int j = 0; j < fine; ++j) {
                for (int i = 0; i < fine; ++i) {
                    sum += radiance(sh::panoramaDirection(x + (i + 0.5) / fine, y + (j + 0.5) / fine, width, height));
                }
            }
            for (int c = 0; c < 3; ++c) result.pixels.at(x, y, c) = float(sum / (fine * fine));
        }
    }
    return result;
}

/// The reference's, whose z is up: (x, y, z) there is (x, z, -y) here.
std::vector<Environment> environments(const std::string& folder, const std::string& only)
{
    std::vector<Environment> all;
    const auto wanted = [&](const std::string& name) { return only.empty() || name.find(only) != std::string::npos; };
    const glm::dvec3 a = glm::normalize(glm::dvec3(0.3, 0.8, 0.5));
    if (wanted("cosine")) {
        all.push_back({"cosine", paint(1024, 512, [a](const glm::dvec3& d) { return std::max(0.0, glm::dot(a, d)); })});
    }
    const double up = pi / 4, round = pi / 6;
    const glm::dvec3 sun(std::cos(up) * std::cos(round), std::sin(up), -std::cos(up) * std::sin(round));
    if (wanted("sunsky")) {
        all.push_back({"sunsky", paint(1024, 512, [sun](const glm::dvec3& d) {
                           const double disc = glm::dot(sun, d) > std::cos(0.27 * pi / 180) ? 1e5 : 0.0;
                           return disc + (d.y >= 0 ? 1 - 0.6 * d.y : 0.2);
                       })});
    }
    if (!folder.empty()) {
        std::vector<std::filesystem::path> files;
        for (const auto& entry : std::filesystem::directory_iterator(folder)) {
            if (entry.path().extension() == ".exr") files.push_back(entry.path());
        }
        std::sort(files.begin(), files.end());
        for (const auto& file : files) {
            const std::string name = file.stem().string();
            if (!wanted(name)) continue;
            all.push_back({name, environment::preparePanorama(io::readLinearImage(file.string()), file.string())});
        }
    }
    return all;
}

struct Mode {
    std::string name;
    DropRadianceOptions options;
};

/// Error of the picture over order and over run time, a line for each environment.
struct Curves {
    plot::Chart overOrder, overTime;

    Curves()
    {
        overOrder.title = "Error against order";
        overOrder.subtitle = "light of a stroke in the picture against brute force; dots: auto";
        overOrder.x.label = "order of the harmonics";
        overOrder.x.scale = plot::Scale::Logarithmic;
        overOrder.y.label = "RMS error over the mean radiance [%]";
        overOrder.y.scale = plot::Scale::Logarithmic;
        overTime = overOrder;
        overTime.title = "Error against run time";
        overTime.subtitle = "the same, over the time to bake the map, once an environment";
        overTime.x.label = "time to bake [ms]";
        automatic.name = "auto";
        automatic.markers = true;
        automatic.line = false;
        automatic.color = "#000000";
    }
    void add(const std::string& name, const std::vector<double>& order, const std::vector<double>& rms,
             const std::vector<double>& ms, double autoOrder, double autoRms)
    {
        // The palette's colours start anew after seven.
        static const char* const more[] = {"#7a4b20", "#e377c2", "#17a0c4"};
        const std::size_t i = overOrder.series.size();
        const std::string color = i < 7 ? "" : more[i % 3];
        overOrder.series.push_back({.name = name, .x = order, .y = rms, .color = color});
        automatic.x.push_back(autoOrder);
        automatic.y.push_back(autoRms);
        overTime.series.push_back({.name = name, .x = ms, .y = rms, .markers = true, .line = false, .color = color});
    }
    void write(const std::string& path)
    {
        overOrder.series.push_back(automatic);
        std::ofstream(path) << plot::svg(std::vector{overOrder, overTime});
    }

private:
    plot::Series automatic;
};

void measure(const Environment& environment, const std::vector<Mode>& modes, const std::vector<View>& views,
             int gridStep, std::ofstream& csv, Curves& curves)
{
    std::vector<glm::dvec3> directions;
    for (const View& view : views) directions.push_back(view.direction);
    const ImageF& pixels = environment.panorama.pixels;
    const std::array<double, 3> index{optics::waterIndex[0], optics::waterIndex[1], optics::waterIndex[2]};
    const int split = pixels.width() < 1024 ? 4 : 2;
    const std::vector<glm::dvec3> truth =
        reference::DropLight(pixels.width(), pixels.height(), split, index)(pixels, directions);
    // The same from coarser parts of pixels: what the truth itself may be off by.
    const std::vector<glm::dvec3> coarser =
        reference::DropLight(pixels.width(), pixels.height(), split / 2, index)(pixels, directions);
    Deviation own;
    double mean = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        own.add(coarser[i], truth[i]);
        mean += (truth[i].r + truth[i].g + truth[i].b) / (3 * double(views.size()));
    }
    std::printf("\n%s: mean %.3g; the truth, from parts of pixels twice as large: RMS %.4f %%, most %.3f %%\n\n",
                environment.name.c_str(), mean, 100 * own.rms() / mean, 100 * own.largest / mean);
    std::printf(
        "| order | lights | RMS %% | most %% | map RMS %% | most %% | picture RMS %% | most %% | bound %% | map | ms "
        "|\n");
    std::printf("|---|---|---|---|---|---|---|---|---|---|---|\n");
    std::vector<double> orders, rms, times;
    double autoOrder = 0, autoRms = 0;
    for (const Mode& mode : modes) {
        const DropRadianceBaker baker(mode.options);
        Timer timer;
        const DropRadiance light = baker.bake(environment.panorama);
        const double ms = timer.milliseconds();
        std::vector<glm::dvec3> exact(views.size());
        parallelFor(0, std::ptrdiff_t(views.size()), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i) {
                exact[std::size_t(i)] = baker.exactly(light, directions[std::size_t(i)]);
            }
        });
        const int step = gridStep > 0 ? gridStep : gridStepFor(light.radiance);
        Deviation sums, map, grid;
        for (std::size_t i = 0; i < views.size(); ++i) {
            glm::dvec3 extra(0.0);
            if (mode.options.paper) extra = 0.7 * environment::sampleMap(pixels, directions[i]);
            sums.add(exact[i] + extra, truth[i]);
            map.add(environment::sampleMap(light.radiance, directions[i]) + extra, truth[i]);
            grid.add(throughGrid(light.radiance, views[i], step) + extra, truth[i]);
        }
        std::printf("| %s%d | %zu | %.3f | %.2f | %.3f | %.2f | %.3f | %.2f | %.3f | %d | %.0f |\n", mode.name.c_str(),
                    light.order, light.lights.size(), 100 * sums.rms() / mean, 100 * sums.largest / mean,
                    100 * map.rms() / mean, 100 * map.largest / mean, 100 * grid.rms() / mean,
                    100 * grid.largest / mean, 100 * light.remainder, light.radiance.width(), ms);
        std::fflush(stdout);
        if (mode.name.empty()) {
            orders.push_back(light.order);
            rms.push_back(100 * grid.rms() / mean);
            times.push_back(ms);
        } else if (!mode.options.paper) {
            autoOrder = light.order;
            autoRms = 100 * grid.rms() / mean;
        }
        if (csv.is_open()) {
            csv << environment.name << ',' << (mode.name.empty() ? "default" : mode.name) << ',' << mode.options.order
                << ',' << light.lights.size() << ',' << light.remainder << ',' << sums.rms() / mean << ','
                << sums.largest / mean << ',' << map.rms() / mean << ',' << map.largest / mean << ','
                << grid.rms() / mean << ',' << grid.largest / mean << ',' << ms << '\n';
        }
    }
    curves.add(environment.name, orders, rms, times, autoOrder, autoRms);
}

}  // namespace

int main(int argc, char** argv)
try {
    std::string folder, only, picture, orders = "1,2,3,4,6,8,12,16,24,32,48,64";
    int gridStep = 0;
    std::ofstream csv;
    for (int i = 1; i + 1 < argc; i += 2) {
        const std::string flag = argv[i];
        if (flag == "--hdri") folder = argv[i + 1];
        if (flag == "--only") only = argv[i + 1];
        if (flag == "--orders") orders = argv[i + 1];
        if (flag == "--grid") gridStep = std::max(1, std::atoi(argv[i + 1]));
        if (flag == "--plot") picture = argv[i + 1];
        if (flag == "--csv") csv.open(argv[i + 1]);
    }
    if (csv.is_open()) {
        csv << "env,mode,order,lights,remainder,rms_exact,max_exact,rms_map,max_map,rms_grid,max_grid,ms\n";
    }
    std::vector<Mode> modes;
    std::istringstream list(orders);
    for (std::string order; std::getline(list, order, ',');) {
        if (order != "auto") modes.push_back({"", {.order = std::atoi(order.c_str())}});
    }
    modes.push_back({"auto: ", {}});
    modes.push_back({"paper: ", {.order = 3, .paper = true}});
    const std::vector<View> views = someViews();
    Curves curves;
    for (const Environment& environment : environments(folder, only)) {
        measure(environment, modes, views, gridStep, csv, curves);
    }
    if (!picture.empty()) curves.write(picture);
    return 0;
} catch (const virga::Error& error) {
    std::fprintf(stderr, "bench_light: %s\n", error.what());
    return virga::exitCode(error.code());
}
