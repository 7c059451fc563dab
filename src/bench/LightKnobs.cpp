// Knobs of the light that drops return and of the fog in front of it, measured as functions and not as pictures:
// radiance along directions, coefficients, transmittance along depths. On the panoramas and settings of the clips.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "bench/Knob.h"
#include "core/Parallel.h"
#include "core/Timer.h"
#include "environment/DropRadiance.h"
#include "reference/DropLight.h"
#include "sh/Harmonics.h"
#include "shot/ShotScene.h"

namespace virga::bench {
namespace {

constexpr int directionCount = 300;

/// Milliseconds of `work`, the least of three.
template <class Work>
double least_ms(Work&& work)
{
    double least = std::numeric_limits<double>::infinity();
    for (int run = 0; run < 3; ++run) {
        const Timer clock;
        work();
        least = std::min(least, clock.milliseconds());
    }
    return least;
}

/// A clip's panorama, as the program prepares or makes it. At most 1024 wide: the truth looks at every pixel.
environment::Panorama panoramaOf(const Clip& clip)
{
    shot::Wanted wanted;
    wanted.panorama = true;
    shot::ShotScene scene(clip.settings, clip.shot, wanted, {});
    scene.light->update(clip.frame.number, scene.viewOf(clip.frame.pixels, clip.frame.number));
    return scene.light->panorama();
}

/// Even over the sphere, the same on every machine (a Fibonacci lattice).
std::vector<glm::dvec3> directions()
{
    std::vector<glm::dvec3> all;
    for (int i = 0; i < directionCount; ++i) {
        const double y = 1 - (2 * i + 1.0) / directionCount, around = i * std::numbers::pi * (3 - std::sqrt(5.0)),
                     r = std::sqrt(1 - y * y);
        all.emplace_back(r * std::cos(around), y, r * std::sin(around));
    }
    return all;
}

const std::vector<Measure> radianceMeasures = {{"rms", "RMS error of a stroke's radiance over its mean"},
                                               {"max", "the largest error over the mean"}};

std::vector<double> radianceErrors(const std::vector<glm::dvec3>& found, const std::vector<glm::dvec3>& truth)
{
    double squares = 0, most = 0, mean = 0;
    const double count = 3 * double(truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            const double off = found[i][c] - truth[i][c];
            squares += off * off / count;
            most = std::max(most, std::abs(off));
            mean += truth[i][c] / count;
        }
    return {std::sqrt(squares) / mean, most / mean};
}

std::vector<glm::dvec3> sampled(ConstImageViewF map, const std::vector<glm::dvec3>& along)
{
    std::vector<glm::dvec3> radiance;
    for (const glm::dvec3& direction : along) radiance.push_back(sh::sampleMap(map, direction));
    return radiance;
}

/// Each clip's panorama, and what a drop returns along the directions.
struct Lit {
    environment::Panorama panorama;
    std::vector<glm::dvec3> truth;
};

Lit litBy(const Clip& clip)
{
    Lit lit{panoramaOf(clip), {}};
    const ImageF& pixels = lit.panorama.pixels;
    lit.truth = reference::DropLight(pixels.width(), pixels.height(), pixels.width() < 1024 ? 2 : 1,
                                     {optics::waterIndex[0], optics::waterIndex[1], optics::waterIndex[2]})(
        pixels, directions());
    return lit;
}

constexpr double automatic = -1;

Knob lightOrder()
{
    Knob knob;
    knob.name = "light-order";
    knob.title = "--env-order: the light of a stroke";
    knob.against = "every pixel of the panorama times D(theta), for 300 directions";
    knob.timed = "baking the map, once an environment, the least of three";
    knob.values = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64, automatic};
    knob.standard = automatic;
    knob.standardVariant = "auto";
    knob.measures = radianceMeasures;
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        for (const Clip& clip : around.clips) {
            const Lit lit = litBy(clip);
            for (const double value : self.values) {
                const bool isAuto = value == automatic;
                // Of a plate's own light the program asks for no search (DropRadianceOptions::plateOrder).
                const int order = !isAuto                     ? int(value)
                                  : clip.settings.env.empty() ? environment::DropRadianceOptions::plateOrder
                                                              : environment::DropRadianceOptions::autoOrder;
                const environment::DropRadianceBaker baker({.order = order});
                environment::DropRadiance light;
                const double ms = least_ms([&] { light = baker.bake(lit.panorama); });
                record.point({clip.name, isAuto ? self.standardVariant : "", isAuto ? light.order : value, 1, ms,
                              radianceErrors(sampled(light.radiance, directions()), lit.truth)});
            }
        }
    };
    return knob;
}

Knob lightMap()
{
    Knob knob;
    knob.name = "light-map";
    knob.title = "size of the map that the light is baked to, at --env-order auto";
    knob.unit = "pixels wide";
    knob.against = "every pixel of the panorama times D(theta), for 300 directions";
    knob.timed = "filling the map from harmonics and lights, direction by direction (as it is baked: by rows)";
    knob.values = {16, 32, 64, 128, 256, 512, automatic};
    knob.standard = automatic;
    knob.standardVariant = "as baked";
    knob.measures = radianceMeasures;
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        for (const Clip& clip : around.clips) {
            const Lit lit = litBy(clip);
            const environment::DropRadianceBaker baker({.order = clip.settings.env.empty()
                                                                     ? environment::DropRadianceOptions::plateOrder
                                                                     : environment::DropRadianceOptions::autoOrder});
            environment::DropRadiance light;
            const double baking_ms = least_ms([&] { light = baker.bake(lit.panorama); });
            for (const double value : self.values) {
                if (value == automatic) {
                    record.point({clip.name, self.standardVariant, double(light.radiance.width()), 1, baking_ms,
                                  radianceErrors(sampled(light.radiance, directions()), lit.truth)});
                    continue;
                }
                const int width = int(value), height = width / 2;
                ImageF map(width, height, 3);
                const Timer clock;
                parallelFor(0, height, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
                    for (int y = int(first); y < int(last); ++y)
                        for (int x = 0; x < width; ++x) {
                            const glm::dvec3 radiance =
                                baker.exactly(light, sh::panoramaDirection(x + 0.5, y + 0.5, width, height));
                            for (int c = 0; c < 3; ++c) map.at(x, y, c) = float(radiance[c]);
                        }
                });
                record.point({clip.name, "", value, 1, clock.milliseconds(),
                              radianceErrors(sampled(map, directions()), lit.truth)});
            }
        }
    };
    return knob;
}

/// Blocks of block x block pixels averaged, a row's weighted with its solid angle.
ImageF reduced(const ImageF& panorama, int block)
{
    ImageF small(panorama.width() / block, panorama.height() / block, 3);
    const auto area = [&](int y) {
        return std::cos(std::numbers::pi * y / panorama.height()) -
               std::cos(std::numbers::pi * (y + 1) / panorama.height());
    };
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                double sum = 0, weight = 0;
                for (int j = 0; j < block; ++j)
                    for (int i = 0; i < block; ++i) {
                        sum += area(block * y + j) * double(panorama.at(block * x + i, block * y + j, c));
                        weight += area(block * y + j);
                    }
                small.at(x, y, c) = float(sum / weight);
            }
    return small;
}

/// Coefficients by brute force: each pixel cut into 3 x 3 parts, each part's value times Y_lm at its middle and its
/// solid angle.
sh::Harmonics summed(const ImageF& map, int order)
{
    constexpr int parts = 3;
    std::vector<sh::Harmonics> rows(std::size_t(map.height()), sh::Harmonics(order));
    const int height = map.height() * parts, width = map.width() * parts;
    parallelFor(0, map.height(), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y)
            for (int j = 0; j < parts; ++j) {
                const int row = y * parts + j;
                const double area =
                    (std::cos(std::numbers::pi * row / height) - std::cos(std::numbers::pi * (row + 1) / height)) * 2 *
                    std::numbers::pi / width;
                for (int x = 0; x < width; ++x) {
                    const std::vector<double> basis =
                        sh::basis(order, sh::panoramaDirection(x + 0.5, row + 0.5, width, height));
                    const float* p = map.pixel(x / parts, y);
                    const glm::dvec3 light = area * glm::dvec3(p[0], p[1], p[2]);
                    for (std::size_t k = 0; k < basis.size(); ++k)
                        rows[std::size_t(y)].coefficient[k] += basis[k] * light;
                }
            }
    });
    sh::Harmonics sum(order);
    for (const sh::Harmonics& row : rows)
        for (std::size_t k = 0; k < sum.coefficient.size(); ++k) sum.coefficient[k] += row.coefficient[k];
    return sum;
}

/// Root of the sum of squares of the difference over that of the truth, and the largest over the largest.
std::vector<double> coefficientErrors(const sh::Harmonics& found, const sh::Harmonics& truth)
{
    double squares = 0, whole = 0, most = 0, largest = 0;
    for (std::size_t k = 0; k < truth.coefficient.size(); ++k)
        for (int c = 0; c < 3; ++c) {
            const double off = found.coefficient[k][c] - truth.coefficient[k][c];
            squares += off * off;
            whole += truth.coefficient[k][c] * truth.coefficient[k][c];
            most = std::max(most, std::abs(off));
            largest = std::max(largest, std::abs(truth.coefficient[k][c]));
        }
    return {std::sqrt(squares / whole), most / largest};
}

Knob projection()
{
    Knob knob;
    knob.name = "env-projection";
    knob.title = "resolution at which the panorama is projected, to order 8";
    knob.unit = "pixels wide";
    knob.against = "each pixel of the whole panorama, cut into 3 x 3, times Y_lm";
    knob.timed = "the projection, the least of three";
    knob.values = {16, 32, 64, 128, 256, 512, 1024, automatic};
    knob.standard = automatic;
    knob.standardVariant = "whole";
    knob.measures = {{"rms", "error of the coefficients, root of the sum of squares, over theirs"},
                     {"max", "the largest error over the largest coefficient"}};
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        constexpr int order = 8;
        for (const Clip& clip : around.clips) {
            const ImageF panorama = panoramaOf(clip).pixels;
            const sh::Harmonics truth = summed(panorama, order);
            for (const double value : self.values) {
                const int block = value == automatic ? 1 : panorama.width() / std::max(1, int(value));
                if (value != automatic && (block < 2 || panorama.height() % block != 0)) continue;
                const ImageF map = reduced(panorama, block);
                sh::Harmonics found;
                const double ms = least_ms([&] { found = sh::projectPanorama(map, order, sh::PixelValue::Mean); });
                record.point({clip.name, value == automatic ? self.standardVariant : "", double(map.width()), 1, ms,
                              coefficientErrors(found, truth)});
            }
        }
    };
    return knob;
}

Knob fogTable()
{
    Knob knob;
    knob.name = "fog-table";
    knob.title = "entries of the table of the fog's optical depth over depth";
    knob.unit = "entries";
    knob.against = "the optical depth itself, at 2000 depths from 0.3 to 1000 m and at infinity";
    knob.timed = "making the table, once a focal length";
    knob.values = {16, 32, 64, 128, 256, 512, 1024};
    knob.standard = shared::fogTableSize;
    knob.measures = {{"rmse", "RMS error of the transmittance"}, {"max", "the largest error of the transmittance"}};
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        constexpr double scale_m = 20;  // depth in the middle of the table
        for (const Clip& clip : around.clips) {
            const shot::ShotScene scene(clip.settings, clip.shot, {}, {});
            const particles::Exposure exposure = scene.exposureAt(clip.frame.number);
            std::vector<double> depths, truth;
            for (int i = 0; i < 2000; ++i) depths.push_back(0.3 * std::pow(1000 / 0.3, i / 1999.0));
            depths.push_back(std::numeric_limits<double>::infinity());
            for (const double depth : depths) truth.push_back(std::exp(-scene.fogOpticalDepth(depth, exposure)));
            for (const double value : self.values) {
                const int entries = int(value);
                std::vector<float> table;
                const Timer clock;
                for (int i = 0; i < entries; ++i) {
                    const double place = double(i) / (entries - 1);
                    table.push_back(float(scene.fogOpticalDepth(
                        place < 1 ? scale_m * place / (1 - place) : std::numeric_limits<double>::infinity(),
                        exposure)));
                }
                const double ms = clock.milliseconds();
                double squares = 0, most = 0;
                for (std::size_t i = 0; i < depths.size(); ++i) {
                    const double place =
                        (std::isinf(depths[i]) ? 1 : depths[i] / (depths[i] + scale_m)) * (entries - 1);
                    const auto entry = std::min(std::size_t(place), std::size_t(entries - 2));
                    const double optical = double(table[entry]) +
                                           (double(table[entry + 1]) - double(table[entry])) * (place - double(entry));
                    const double off = std::exp(-optical) - truth[i];
                    squares += off * off / double(depths.size());
                    most = std::max(most, std::abs(off));
                }
                record.point({clip.name, "", value, 1, ms, {std::sqrt(squares), most}});
            }
        }
    };
    return knob;
}

}  // namespace

std::vector<Knob> lightKnobs() { return {lightOrder(), lightMap(), projection(), fogTable()}; }

}  // namespace virga::bench
