// Knobs of which drops there are: how many classes of size fall at speeds of their own, and how large the cells are
// that drops are looked up in. Measured on rain of several rates, without a plate.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/Knob.h"
#include "bench/PlainRain.h"
#include "matte/OscillatingDrops.h"
#include "rainfall/TerminalSpeed.h"
#include "shot/Settings.h"

namespace virga::bench {
namespace {

constexpr double rates_mm_h[] = {5, 25, 100};

/// Diameters [m] of the drops within `far_m` whose middle is in the picture when the shutter opens, sorted.
std::vector<double> diametersInView(const particles::RainField& field, const PlainScene& scene, double far_m)
{
    const particles::Exposure exposure = exposureOf(scene, 0);
    const double focal = exposure.projection.focal_px;
    // A threshold that every drop reaches: each class is looked for all the way.
    const particles::CellList list = field.cellsInView(exposure, {.near_m = 0.1, .far_m = far_m, .threshold = 1e-12});
    std::vector<double> diameters;
    for (std::size_t c = 0; c < list.cells.size(); ++c)
        for (std::uint32_t i = 0; i < list.dropsIn(c); ++i) {
            const shared::Cell& cell = list.cells[c];
            const shared::Drop drop = shared::dropInCell(cell, list.classes[cell.key.z], list.waves[0], list.waves[1],
                                                         list.waves[2], list.waves[3], i);
            const double depth = -double(drop.open.z);
            if (depth < 0.1 || depth > far_m || std::abs(double(drop.open.x)) * focal > 0.5 * scene.width * depth ||
                std::abs(double(drop.open.y)) * focal > 0.5 * scene.height * depth)
                continue;
            diameters.push_back(double(drop.diameter));
        }
    std::sort(diameters.begin(), diameters.end());
    return diameters;
}

/// Largest distance between the share of drops under a diameter that was found and that of the law (Kolmogorov and
/// Smirnov); of n drops that follow the law about 0.87 / sqrt(n).
double distanceFromLaw(const std::vector<double>& sorted, const rainfall::DropSizes& sizes, double smallest)
{
    const double all = sizes.numberPerVolume(smallest);
    double most = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const double law = sizes.numberPerVolume(smallest, sorted[i]) / all, n = double(sorted.size());
        most = std::max({most, std::abs(law - double(i) / n), std::abs(law - double(i + 1) / n)});
    }
    return most;
}

/// How much slower or faster strokes fall than their drops should, as a share of the speed, rms over the strokes of an
/// average picture (rainfall::SizeClassOptions has what is visible), and the most [m/s].
std::pair<double, double> speedError(const rainfall::DropSizes& sizes, const std::vector<rainfall::SizeClass>& classes)
{
    const rainfall::SizeClassOptions seen;
    double squares = 0, speeds = 0, most = 0;
    for (const rainfall::SizeClass& c : classes) {
        const auto overStrokes = [&](auto&& f) {
            return sizes.integrate(
                [&](double d) {
                    const double reach = std::min(d * d / rainfall::terminalSpeed(d) * seen.sight, seen.farthest);
                    return reach * reach * reach * f(rainfall::terminalSpeed(d));
                },
                c.d0, c.d1);
        };
        squares += overStrokes([&](double v) { return (v - c.speed) * (v - c.speed); });
        speeds += overStrokes([](double v) { return v * v; });
        most = std::max(most, c.speedError);
    }
    return {std::sqrt(squares / speeds), most};
}

/// Milliseconds of listing the cells and placing each drop, the median of five pictures of the usual rain.
double placing_ms(const particles::RainField& field, PlainRain& rain, std::size_t& listed, std::size_t& drawn)
{
    std::vector<double> ms;
    for (int frame = 0; frame < 6; ++frame) {
        const PlainRain::Frame f = rain.render(field, frame);
        if (frame > 0) ms.push_back(f.cells_ms + f.passMs("drops"));
        listed = f.listed;
        drawn = f.picture.strokes;
    }
    return medianOf(ms);
}

/// --threshold and --opacity of virga rain.
PlainScene usualScene()
{
    const shot::Settings settings;
    return {.visibility = {.near_m = settings.near_m,
                           .far_m = settings.far_m,
                           .threshold = settings.threshold / settings.opacity}};
}

/// field: of a rate, a seed and the knob's value.
using FieldOf = std::function<particles::RainField(double rate_mm_h, std::uint32_t seed, double value)>;

template <class Errors>
void measureFields(const Knob& knob, const Surroundings& around, Record& record, const FieldOf& fieldOf,
                   Errors&& errorsOf)
{
    const PlainScene scene = usualScene();
    PlainRain rain(scene, matte::makeOscillatingDropAtlas(1));
    for (const double rate : rates_mm_h)
        for (int seed = 1; seed <= around.seeds; ++seed)
            for (const double value : knob.values) {
                const particles::RainField field = fieldOf(rate, std::uint32_t(seed), value);
                std::size_t listed = 0, drawn = 0;
                const double ms = placing_ms(field, rain, listed, drawn);
                const std::vector<double> diameters = diametersInView(field, scene, 4);
                record.point({.clip = fmt::format("{:g} mm/h", rate),
                              .value = value,
                              .seed = seed,
                              .ms = ms,
                              .errors = errorsOf(field, rainfall::DropSizes(rate), diameters,
                                                 drawn > 0 ? double(listed) / double(drawn) : 0.0)});
            }
}

Knob sizeClasses()
{
    Knob knob;
    knob.name = "size-classes";
    knob.title = "size classes: groups of drops that fall at one speed";
    knob.against = "each drop at its own speed; the law of sizes";
    knob.timed = "listing the cells of a picture of 720 x 480 and placing each drop, the median of five";
    knob.values = {4, 8, 16, 32, 64, 128};
    knob.standard = rainfall::SizeClassOptions{}.count;
    knob.measures = {{"speed_rms", "speed of strokes, RMS error over the RMS speed"},
                     {"speed_max", "the largest error of a speed [m/s]"},
                     {"size_distance", "Kolmogorov's distance of the diameters of all drops within 4 m from the law"},
                     {"listed", "drops looked at for each that is drawn"}};
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        measureFields(
            self, around, record,
            [](double rate, std::uint32_t seed, double value) { return fieldOfRate(rate, seed, 1, 8, int(value)); },
            [](const particles::RainField& field, const rainfall::DropSizes& sizes, const std::vector<double>& found,
               double listed) -> std::vector<double> {
                const auto [rms, most] = speedError(sizes, field.classes());
                return {rms, most, distanceFromLaw(found, sizes, rainfall::SizeClassOptions{}.smallestDiameter),
                        listed};
            });
    };
    return knob;
}

Knob cellSize()
{
    Knob knob;
    knob.name = "cell-size";
    knob.title = "cell size: drops that a cell is made for";
    knob.unit = "drops";
    knob.against = "the law of sizes and the density of the rain, which no size of cells may change";
    knob.timed = "listing the cells of a picture of 720 x 480 and placing each drop, the median of five";
    knob.values = {1, 2, 4, 8, 16, 32, 64, 128};
    knob.standard = 32;
    knob.measures = {{"size_distance", "Kolmogorov's distance of the diameters of all drops within 4 m from the law"},
                     {"count", "drops within 4 m, off what there should be, in standard deviations"},
                     {"listed", "drops looked at for each that is drawn"}};
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        measureFields(
            self, around, record,
            [](double rate, std::uint32_t seed, double value) { return fieldOfRate(rate, seed, 1, value); },
            [](const particles::RainField& field, const rainfall::DropSizes& sizes, const std::vector<double>& found,
               double listed) -> std::vector<double> {
                const double smallest = rainfall::SizeClassOptions{}.smallestDiameter;
                const PlainScene scene = usualScene();
                const double focal = exposureOf(scene, 0).projection.focal_px,
                             area = scene.width * scene.height / (focal * focal),
                             expected = sizes.numberPerVolume(smallest) * field.densityScale() * area *
                                        (std::pow(4.0, 3) - std::pow(0.1, 3)) / 3;
                return {distanceFromLaw(found, sizes, smallest),
                        (double(found.size()) - expected) / std::sqrt(expected), listed};
            });
    };
    return knob;
}

}  // namespace

std::vector<Knob> rainKnobs() { return {sizeClasses(), cellSize()}; }

}  // namespace virga::bench
