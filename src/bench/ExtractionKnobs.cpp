// Knobs of `virga extract`: how closely the steps that iterate are solved, how often alphas, scene and what follows
// from them are found anew, and whether it pays to begin with smaller pictures. Footage is drawn, so that alpha and
// scene are known.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bench/DrawnRain.h"
#include "bench/Knob.h"
#include "core/Timer.h"
#include "matte/RainExtraction.h"
#include "matte/TemporalMedian.h"

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

/// Means of 2 x 2.
ImageF halved(const ImageF& image)
{
    ImageF half(image.width() / 2, image.height() / 2, image.channels());
    for (int y = 0; y < half.height(); ++y)
        for (int x = 0; x < half.width(); ++x)
            for (int c = 0; c < half.channels(); ++c)
                half.at(x, y, c) = 0.25f * (image.at(2 * x, 2 * y, c) + image.at(2 * x + 1, 2 * y, c) +
                                            image.at(2 * x, 2 * y + 1, c) + image.at(2 * x + 1, 2 * y + 1, c));
    return half;
}

/// Twice as wide and high, linearly between the middles of the pixels.
ImageF doubled(const ImageF& half)
{
    ImageF image(2 * half.width(), 2 * half.height(), half.channels());
    for (int y = 0; y < image.height(); ++y)
        for (int x = 0; x < image.width(); ++x) {
            const float fx = std::clamp(0.5f * float(x) - 0.25f, 0.0f, float(half.width() - 1));
            const float fy = std::clamp(0.5f * float(y) - 0.25f, 0.0f, float(half.height() - 1));
            const int x0 = int(fx), y0 = int(fy);
            const int x1 = std::min(x0 + 1, half.width() - 1), y1 = std::min(y0 + 1, half.height() - 1);
            for (int c = 0; c < image.channels(); ++c)
                image.at(x, y, c) =
                    std::lerp(std::lerp(half.at(x0, y0, c), half.at(x1, y0, c), fx - float(x0)),
                              std::lerp(half.at(x0, y1, c), half.at(x1, y1, c), fx - float(x0)), fy - float(y0));
        }
    return image;
}

/// The scene of the pyramid's coarser levels, with the detail that the frames' median has beyond it; none of one level.
/// Sides divide by 2^(levels - 1).
ImageF sceneFromCoarser(const std::vector<ImageF>& frames, int levels)
{
    if (levels < 2) return {};
    std::vector<ImageF> coarser;
    for (const ImageF& frame : frames) coarser.push_back(halved(frame));
    const ImageF start = sceneFromCoarser(coarser, levels - 1);
    ImageF scene = doubled(matte::extractRain(coarser, {}, start).scene);
    const ImageF median = matte::temporalMedian(frames), smooth = doubled(halved(median));
    for (std::size_t i = 0; i < scene.size(); ++i) scene.data()[i] += median.data()[i] - smooth.data()[i];
    return scene;
}

/// extract: with the knob's value.
Knob extraction(Knob knob, std::function<matte::Extraction(std::vector<ImageF>&, double)> extract)
{
    knob.against = "the alpha and the scene that the footage was drawn with: 12 frames of 192 x 128, noise 2/255";
    knob.timed = "extracting the rain of 12 frames, the least of three";
    knob.measures = {{"alpha_rmse", "RMS error of alpha"},
                     {"scene_rmse", "RMS error of the scene"},
                     {"objective", "F, what is minimised, after the last step"}};
    knob.measure = [extract](const Knob& self, const Surroundings& around, Record& record) {
        for (const auto& [name, wet] : {std::pair{"16 % wet", 0.16}, {"48 % wet", 0.48}})
            for (int seed = 1; seed <= around.seeds; ++seed) {
                const DrawnRain drawn = footage(wet, unsigned(seed));
                if (seed == 1) record.picture(name, "truth", grey(drawn.alphas.front()));
                for (const double value : self.values) {
                    double ms = 1e300;
                    matte::Extraction found;
                    for (int run = 0; run < 3; ++run) {
                        std::vector<ImageF> frames = drawn.frames;
                        const Timer clock;
                        found = extract(frames, value);
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
    Knob pyramid;
    pyramid.name = "extract-pyramid";
    pyramid.title = "Levels of a pyramid that the scene is solved in, from coarse to fine (virga extract has one)";
    pyramid.values = {1, 2, 3};
    pyramid.standard = 1;
    using Frames = std::vector<ImageF>;
    return {extraction(std::move(tolerance),
                       [](Frames& frames, double value) {
                           matte::ExtractionOptions options;
                           options.tolerance = value;
                           return matte::extractRain(frames, options);
                       }),
            extraction(std::move(rounds),
                       [](Frames& frames, double value) {
                           matte::ExtractionOptions options;
                           options.rounds = int(value);
                           return matte::extractRain(frames, options);
                       }),
            extraction(std::move(pyramid), [](Frames& frames, double value) {
                const ImageF start = sceneFromCoarser(frames, int(value));
                return matte::extractRain(frames, {}, start);
            })};
}

}  // namespace virga::bench
