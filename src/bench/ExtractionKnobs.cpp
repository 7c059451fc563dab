// Knobs of `virga extract`: how closely the steps that iterate are solved, and how often alphas, scene and what follows
// from them are found anew. Footage is drawn, so that alpha and scene are known.
#include <fmt/format.h>

#include <cmath>

#include "bench/DrawnRain.h"
#include "bench/Knob.h"
#include "core/Timer.h"
#include "matte/RainExtraction.h"

namespace virga::bench {
namespace {

constexpr int width = 192, height = 128;

DrawnRain footage(double wet, unsigned seed)
{
    return drawRain({.width = width,
                     .height = height,
                     .frames = 12,
                     .strokes = int(wet * width * height / 100),
                     .slant = 0.105,
                     .noise = 2.0 / 255,
                     .seed = seed});
}

double rmsOf(const std::vector<ImageF>& found, const std::vector<ImageF>& truth)
{
    double squares = 0;
    for (std::size_t k = 0; k < found.size(); ++k)
        for (std::size_t i = 0; i < found[k].size(); ++i)
            squares += std::pow(double(found[k].data()[i]) - double(truth[k].data()[i]), 2) / double(found[k].size());
    return std::sqrt(squares / double(found.size()));
}

ImageF grey(const ImageF& alpha)
{
    ImageF picture(alpha.width(), alpha.height(), 3);
    for (std::size_t i = 0; i < picture.size(); ++i) picture.data()[i] = alpha.data()[i / 3];
    return picture;
}

/// set: the knob's value in the options.
Knob extraction(Knob knob, void (*set)(matte::ExtractionOptions&, double))
{
    knob.against = "the alpha and the scene that the footage was drawn with: 12 frames of 192 x 128, noise 2/255";
    knob.timed = "extracting the rain of 12 frames, the least of three";
    knob.measures = {{"alpha_rmse", "RMS error of alpha"},
                     {"scene_rmse", "RMS error of the scene"},
                     {"objective", "F, what is minimised, after the last step"}};
    knob.measure = [set](const Knob& self, const Surroundings& around, Record& record) {
        for (const auto& [name, wet] : {std::pair{"16 % wet", 0.16}, {"48 % wet", 0.48}})
            for (int seed = 1; seed <= around.seeds; ++seed) {
                const DrawnRain drawn = footage(wet, unsigned(seed));
                if (seed == 1) record.picture(name, "truth", grey(drawn.alphas.front()));
                for (const double value : self.values) {
                    matte::ExtractionOptions options;
                    set(options, value);
                    double ms = 1e300;
                    matte::Extraction found;
                    for (int run = 0; run < 3; ++run) {
                        std::vector<ImageF> frames = drawn.frames;
                        const Timer clock;
                        found = matte::extractRain(frames, options);
                        ms = std::min(ms, clock.milliseconds());
                    }
                    record.point({name,
                                  "",
                                  value,
                                  seed,
                                  ms,
                                  {rmsOf(found.alphas, drawn.alphas), rmsOf({found.scene}, {drawn.scene}),
                                   found.history.back().total()}});
                    if (seed == 1 && (value == self.standard || value == self.values.front()))
                        record.picture(name, fmt::format("{:g}", value), grey(found.alphas.front()));
                }
            }
    };
    return knob;
}

}  // namespace

std::vector<Knob> extractionKnobs()
{
    Knob tolerance;
    tolerance.name = "extract-tolerance";
    tolerance.title = "virga extract --tolerance";
    tolerance.values = {0.3, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
    tolerance.standard = matte::ExtractionOptions{}.tolerance;
    Knob rounds;
    rounds.name = "extract-rounds";
    rounds.title = "virga extract --iterations";
    rounds.values = {1, 2, 3, 4, 6};
    rounds.standard = matte::ExtractionOptions{}.rounds;
    return {extraction(std::move(tolerance), [](matte::ExtractionOptions& o, double value) { o.tolerance = value; }),
            extraction(std::move(rounds), [](matte::ExtractionOptions& o, double value) { o.rounds = int(value); })};
}

}  // namespace virga::bench
