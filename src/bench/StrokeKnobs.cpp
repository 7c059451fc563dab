// Knobs of what a stroke leaves on the pixels: how it is integrated over them, how finely its matte is drawn, and how
// finely strokes over one another are added up.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bench/Knob.h"
#include "bench/PlainRain.h"
#include "core/Timer.h"
#include "matte/OscillatingDrops.h"
#include "passes/CpuFrame.h"
#include "reference/RainLayer.h"

namespace virga::bench {
namespace {

constexpr double diameter_m = 2e-3;
constexpr int finest = 64;  // samples along a pixel's edge of what counts as the truth

/// Drops of 2 mm in a slice of air in which they are about `width_px` wide, through a long lens.
PlainScene sliceOf(double width_px)
{
    PlainScene scene{.width = 96, .height = 64, .fov_deg = 10, .layers = true};
    const double z = exposureOf(scene, 0).projection.focal_px * diameter_m / width_px;
    scene.visibility = {.near_m = 0.9 * z, .far_m = 1.1 * z, .threshold = 1e-9};
    return scene;
}

/// So many that a tenth of the picture or so is covered.
particles::RainField someDrops(const PlainScene& scene, double width_px, std::uint32_t seed)
{
    return fieldOfSize(diameter_m, scene, width_px < 2 ? 60 : width_px < 6 ? 20 : 6, seed);
}

/// Alpha of the rain by the reference.
ImageF sampledAlpha(const particles::RainField& field, const PlainScene& scene, const matte::StrokeAtlas& atlas,
                    int samples)
{
    reference::Scene world;
    world.exposure = exposureOf(scene, 0);
    world.focalAtClose_px = world.exposure.projection.focal_px;
    world.rain = {.field = &field,
                  .visibility = scene.visibility,
                  .allDrops = false,
                  .atlas = &atlas,
                  .inverseFocus_1_m = 0.1,
                  .samples = samples};
    const reference::ImageD white(scene.width, scene.height, 3, 1.0);
    const reference::ImageD rain = reference::rainLayer(world, {}, white, white).rain;
    ImageF alpha(scene.width, scene.height, 3);
    for (int y = 0; y < alpha.height(); ++y)
        for (int x = 0; x < alpha.width(); ++x) std::fill_n(alpha.pixel(x, y), 3, float(rain.at(x, y, 3)));
    return alpha;
}

/// The same as it is drawn; ms: of placing and drawing the strokes.
ImageF drawnAlpha(const particles::RainField& field, const PlainScene& scene, const matte::StrokeAtlas& atlas,
                  double& ms)
{
    PlainRain rain(scene, atlas);
    std::vector<double> times;
    PlainRain::Frame frame;
    for (int i = 0; i < 5; ++i) {
        frame = rain.render(field);
        times.push_back(frame.passMs("drops") + frame.passMs("strokes"));
    }
    ms = medianOf(times);
    ImageF alpha(scene.width, scene.height, 3);
    for (int y = 0; y < alpha.height(); ++y)
        for (int x = 0; x < alpha.width(); ++x) std::fill_n(alpha.pixel(x, y), 3, frame.picture.rain.at(x, y, 3));
    return alpha;
}

const std::vector<Measure> coverageMeasures = {{"rmse", "RMS error of alpha over its RMS"},
                                               {"max", "the largest error of alpha"},
                                               {"mass", "alpha of all pixels over the truth's"}};

std::vector<double> coverageErrors(const ImageF& found, const ImageF& truth)
{
    double squares = 0, whole = 0, most = 0, mass = 0, trueMass = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const double a = double(found.data()[i]), b = double(truth.data()[i]);
        squares += (a - b) * (a - b);
        whole += b * b;
        most = std::max(most, std::abs(a - b));
        mass += a;
        trueMass += b;
    }
    return {std::sqrt(squares / whole), most, mass / trueMass};
}

struct Look {
    std::string name;
    double width_px;
    const matte::StrokeAtlas& mattes;
};

Knob coverage()
{
    Knob knob;
    knob.name = "coverage";
    knob.title = "coverage of strokes: sampled N x N times a pixel, or integrated as they are drawn (at 0)";
    knob.unit = "samples";
    knob.against = fmt::format("the reference, {0} x {0} samples a pixel", finest);
    knob.timed = "placing and drawing the strokes";
    knob.values = {0, 1, 2, 4, 8, 16, 32};
    knob.standard = 0;
    knob.standardVariant = "as drawn";
    knob.measures = coverageMeasures;
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        const matte::StrokeAtlas lively = matte::makeOscillatingDropAtlas(1),
                                 plain =
                                     matte::makeOscillatingDropAtlas(1, {.groups = 1, .variants = 2, .liveliness = 0});
        for (const Look& look : {Look{"plain, 0.3 px", 0.3, plain},
                                 {"plain, 1 px", 1, plain},
                                 {"plain, 4 px", 4, plain},
                                 {"lively, 4 px", 4, lively}})
            for (int seed = 1; seed <= around.seeds; ++seed) {
                const PlainScene scene = sliceOf(look.width_px);
                const particles::RainField field = someDrops(scene, look.width_px, std::uint32_t(seed));
                const ImageF truth = sampledAlpha(field, scene, look.mattes, finest);
                if (seed == 1) record.picture(look.name, "truth", truth);
                for (const double value : self.values) {
                    const bool isDrawn = value == self.standard;
                    const Timer clock;
                    double ms = 0;
                    const ImageF alpha = isDrawn ? drawnAlpha(field, scene, look.mattes, ms)
                                                 : sampledAlpha(field, scene, look.mattes, int(value));
                    if (!isDrawn) ms = clock.milliseconds();
                    record.point({look.name, isDrawn ? self.standardVariant : "", value, seed, ms,
                                  coverageErrors(alpha, truth)});
                    if (seed == 1 && (isDrawn || value == 1 || value == 4))
                        record.picture(look.name,
                                       isDrawn ? self.standardVariant : fmt::format("{:g} x {:g}", value, value),
                                       alpha);
                }
            }
    };
    return knob;
}

Knob mattes()
{
    constexpr int samples = 24;  // strokes are wide: 64 x 64 would be minutes
    Knob knob;
    knob.name = "mattes";
    knob.title = "resolution of the built-in mattes: texels across, and four times that (64 at least) along";
    knob.unit = "texels";
    knob.against = fmt::format("mattes of 128 x 512 texels, sampled {0} x {0} times a pixel", samples);
    knob.timed = "making the 96 mattes, once a shot";
    knob.values = {4, 8, 16, 32, 64};
    knob.standard = matte::OscillatingDropOptions{}.width;
    knob.measures = coverageMeasures;
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        const matte::StrokeAtlas fine = matte::makeOscillatingDropAtlas(1, {.width = 128, .height = 512});
        for (const double width_px : {1.0, 4.0, 12.0})
            for (int seed = 1; seed <= around.seeds; ++seed) {
                const std::string name = fmt::format("{:g} px wide", width_px);
                const PlainScene scene = sliceOf(width_px);
                const particles::RainField field = someDrops(scene, width_px, std::uint32_t(seed));
                const ImageF truth = sampledAlpha(field, scene, fine, samples);
                if (seed == 1) record.picture(name, "truth", truth);
                for (const double value : self.values) {
                    const Timer clock;
                    const matte::StrokeAtlas atlas = matte::makeOscillatingDropAtlas(
                        1, {.width = int(value), .height = std::max(64, 4 * int(value))});
                    const double ms = clock.milliseconds();
                    double drawing_ms = 0;
                    const ImageF alpha = drawnAlpha(field, scene, atlas, drawing_ms);
                    record.point({name, "", value, seed, ms, coverageErrors(alpha, truth)});
                    if (seed == 1 && (value == self.standard || value == self.values.front()))
                        record.picture(name, fmt::format("{:g} texels", value), alpha);
                }
            }
    };
    return knob;
}

/// Strokes on one pixel: how many, and what they cover.
struct Pile {
    std::string name;
    int strokes;
    double least, most;
};

/// Transmittance of a pile from sums of optical depth in steps of 2^-bits, as the passes keep them, and in truth.
std::pair<double, double> transmittanceOf(const std::vector<float>& alphas, int bits)
{
    const float scale = std::ldexp(1.0f, bits);
    std::uint32_t sum = 0;
    double truth = 1;
    for (const float alpha : alphas) {
        sum += passes::cpu::steps(passes::cpu::opticalDepthOf(alpha) * scale);
        truth *= 1 - double(alpha);
    }
    return {double(std::exp(-float(sum) / scale)), truth};
}

Knob stacking()
{
    Knob knob;
    knob.name = "stacking";
    knob.title = "strokes over one another: optical depth added in steps of 2^-N";
    knob.unit = "bits";
    knob.against = "the product of what each stroke lets through, in double precision";
    knob.timed = "adding up a million strokes on one core, the logarithm included";
    knob.values = {8, 10, 12, 14, 16, 18, 20, 22};
    knob.standard = std::log2(double(passes::cpu::opticalDepthSteps));
    knob.measures = {{"rmse", "RMS error of the transmittance"}, {"max", "the largest error of the transmittance"}};
    knob.measure = [](const Knob& self, const Surroundings& around, Record& record) {
        constexpr int pixels = 200;
        for (const Pile& pile : {Pile{"5 strokes, alpha to 0.5", 5, 0.01, 0.5},
                                 {"100 strokes, alpha to 0.02", 100, 1e-4, 0.02},
                                 {"10,000 strokes, alpha to 0.0002", 10000, 1e-6, 2e-4}})
            for (int seed = 1; seed <= around.seeds; ++seed) {
                std::mt19937 engine{unsigned(seed)};
                std::vector<std::vector<float>> piles(pixels, std::vector<float>(std::size_t(pile.strokes)));
                for (auto& alphas : piles)
                    for (float& alpha : alphas)
                        alpha = float(pile.least + (pile.most - pile.least) * double(engine()) / 4294967296.0);
                for (const double bits : self.values) {
                    double squares = 0, most = 0;
                    const Timer clock;
                    for (const auto& alphas : piles) {
                        const auto [found, truth] = transmittanceOf(alphas, int(bits));
                        squares += (found - truth) * (found - truth) / pixels;
                        most = std::max(most, std::abs(found - truth));
                    }
                    record.point({pile.name,
                                  "",
                                  bits,
                                  seed,
                                  clock.milliseconds() * 1e6 / (pixels * pile.strokes),
                                  {std::sqrt(squares), most}});
                }
            }
    };
    return knob;
}

}  // namespace

std::vector<Knob> strokeKnobs() { return {coverage(), mattes(), stacking()}; }

}  // namespace virga::bench
