// Knobs whose error is that of a picture: rendered at each value and compared with what it should be.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "bench/ClipRender.h"
#include "bench/EffectStatistics.h"
#include "bench/Knob.h"
#include "bench/PictureError.h"
#include "shot/Compositor.h"

namespace virga::bench {
namespace {

using shot::Settings;

/// A value of a second knob, turned beside the first.
struct Variant {
    std::string name;
    std::function<void(Settings&)> set;
};

/// How to turn a knob of pictures.
struct PictureKnob {
    /// Settings of the clip before the knob is turned.
    std::function<void(Settings&)> prepare = [](Settings&) {};
    std::function<Measured(const Clip&, Settings, double value)> render;
    /// What it should be. isOneTruth: the same at every value.
    std::function<Measured(const Clip&, Settings, double value)> truth;
    bool isOneTruth = true;
    bool hasSeeds = true;  ///< else another seed is the same picture
    bool hasRain = true;   ///< else rain's statistics are left out
    std::vector<Variant> variants = {{"", [](Settings&) {}}};
    /// At this value the program chooses for itself, and the point stands where it did, as variant "auto".
    std::optional<double> automatic = {};
};

std::vector<Measure> measuresOf(const PictureKnob& how)
{
    std::vector<Measure> measures = {{"rmse", "RMSE over the plate's mean"},
                                     {"max", "largest difference over the plate's mean"},
                                     {"flip", "mean FLIP"}};
    if (!how.hasRain) return measures;
    for (const char* of : {"mean", "variance"})
        measures.push_back({of, fmt::format("{} of what rain and fog change, over the truth's", of)});
    for (const auto& [name, where] : {std::pair{"coarse", "below"}, {"fine", "above"}})
        measures.push_back({name, fmt::format("its power {} an eighth of a cycle a pixel, over the truth's", where)});
    measures.push_back({"spectrum_db", "its power spectrum against the truth's, rms over rings of frequency [dB]"});
    measures.push_back({"skewness", "its skewness"});
    measures.push_back({"true_skewness", "the truth's"});
    return measures;
}

std::vector<double> errorsOf(const PictureKnob& how, const Clip& clip, const Measured& ours, const Measured& truth)
{
    const PictureError error = pictureError(ours.beauty, truth.beauty, meanOf(clip.frame.pixels));
    std::vector<double> errors = {error.rmse, error.most, error.flip};
    if (!how.hasRain) return errors;
    const EffectComparison effect = compareEffects(ours.effect, truth.effect);
    errors.insert(errors.end(), {effect.mean, effect.variance, effect.coarse, effect.fine, effect.spectrum_dB,
                                 effect.skewness, effect.trueSkewness});
    return errors;
}

/// The difference from the truth ten times as large, on grey.
ImageF tenTimesApart(const ImageF& a, const ImageF& b)
{
    ImageF result(a.width(), a.height(), 4, 1);
    for (std::size_t i = 0; i < a.size(); ++i)
        if (i % 4 != 3) result.data()[i] = std::clamp(0.2f + 10 * (a.data()[i] - b.data()[i]), 0.0f, 1.0f);
    return result;
}

void measureClip(const Knob& knob, const PictureKnob& how, const Clip& clip, int seeds, Record& record)
{
    std::optional<Measured> before;  // the truth of the last seed
    for (std::int64_t seed = 1; seed <= (how.hasSeeds ? seeds : 1); ++seed) {
        Settings settings = clip.settings;
        settings.seed = seed;
        how.prepare(settings);
        std::optional<Measured> truth;
        if (how.isOneTruth) truth = how.truth(clip, settings, knob.standard);
        if (seed == 1 && truth) record.picture(clip.name, "truth", truth->beauty);
        for (const Variant& variant : how.variants)
            for (const double value : knob.values) {
                Settings turned = settings;
                variant.set(turned);
                if (!how.isOneTruth) truth = how.truth(clip, turned, value);
                const Measured ours = how.render(clip, turned, value);
                const bool isAutomatic = value == how.automatic;
                record.point({clip.name, isAutomatic ? "auto" : variant.name, isAutomatic ? ours.lightOrder : value,
                              seed, ours.ms, errorsOf(how, clip, ours, *truth)});
                const bool isShown =
                    value == knob.standard || value == knob.values.front() || value == knob.values.back();
                if (seed > 1 || !isShown) continue;
                const std::string caption = fmt::format("{:g}{}{}{}{}", value, knob.unit.empty() ? "" : " ", knob.unit,
                                                        variant.name.empty() ? "" : ", ", variant.name);
                if (!how.isOneTruth) record.picture(clip.name, "truth of " + caption, truth->beauty);
                record.picture(clip.name, caption, ours.beauty);
                record.picture(clip.name, caption + ", ten times off", tenTimesApart(ours.beauty, truth->beauty));
            }
        if (!knob.baseline.empty() && before)
            record.point({clip.name, "", {}, seed, truth->ms, errorsOf(how, clip, *before, *truth)});
        before = std::move(truth);
    }
}

Knob finished(Knob knob, const PictureKnob& how)
{
    knob.measures = measuresOf(how);
    knob.measure = [how](const Knob& self, const Surroundings& around, Record& record) {
        for (const Clip& clip : around.clips) measureClip(self, how, clip, around.seeds, record);
    };
    return knob;
}

auto byReference(const shot::ReferenceOptions& options)
{
    return [options](const Clip& clip, const Settings& s, double) { return renderTruth(clip, s, options); };
}

/// The picture rendered `times` as large and averaged.
Measured supersampled(const Clip& clip, const Settings& settings, int times)
{
    Clip large = clip;
    const ImageF& plate = clip.frame.pixels;
    large.shot.width *= times;
    large.shot.height *= times;
    large.frame.pixels = ImageF(large.shot.width, large.shot.height, 4);
    for (int y = 0; y < large.shot.height; ++y)
        for (int x = 0; x < large.shot.width; ++x)
            std::copy_n(plate.pixel(x / times, y / times), 4, large.frame.pixels.pixel(x, y));
    const Measured fine = renderClip(large, settings);
    Measured result{.beauty = ImageF(plate.width(), plate.height(), 4), .effect = {}, .ms = fine.ms};
    result.effect = result.beauty;
    const float share = 1 / float(times * times);
    for (int y = 0; y < large.shot.height; ++y)
        for (int x = 0; x < large.shot.width; ++x)
            for (int c = 0; c < 4; ++c) {
                result.beauty.at(x / times, y / times, c) += share * fine.beauty.at(x, y, c);
                result.effect.at(x / times, y / times, c) += share * fine.effect.at(x, y, c);
            }
    return result;
}

/// Rounded to `bits` of mantissa: 10 are half's, 23 float's.
float rounded(float value, int bits)
{
    const std::uint32_t kept = ~std::uint32_t(0) << (23 - bits), half = bits < 23 ? 1u << (22 - bits) : 0u;
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(value) + half) & kept);
}

/// The layers, each stored with so many bits, over one another.
Measured recombined(const Clip& clip, const Settings& settings, int bits)
{
    shot::Compositor compositor(settings, clip.shot, {.wanted = {.layers = true}, .device = "cpu", .shaderFolder = {}},
                                {});
    const io::RenderedFrame frame = compositor.render(clip.frame);
    Measured result = measuredOf(frame);
    result.ms = 1e3 * compositor.statistics().renderSeconds;
    result.beauty = layerOf(frame, "plate");
    for (float& value : result.beauty.values()) value = rounded(value, bits);
    for (const char* name : {"fog", "rain"}) {
        const ImageF layer = layerOf(frame, name);
        for (std::size_t i = 0; i < layer.size(); ++i)
            result.beauty.data()[i] = rounded(layer.data()[i], bits) +
                                      (1 - rounded(layer.data()[i / 4 * 4 + 3], bits)) * result.beauty.data()[i];
    }
    return result;
}

/// Beside it --thin at its default and off.
Knob threshold()
{
    Knob knob;
    knob.name = "threshold";
    knob.title = "--threshold: which drops are drawn";
    knob.against = "every drop within 16 m drawn, none folded into fog";
    knob.baseline = "the truth of another seed";
    knob.values = {0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0003, 0.0001};
    knob.standard = Settings{}.threshold;
    PictureKnob how;
    how.prepare = [](Settings& s) { s.far_m = 16; };
    how.render = [](const Clip& clip, Settings s, double value) {
        s.threshold = value;
        return renderClip(clip, s);
    };
    how.truth = byReference({.allDrops = true, .samples = 6, .widestPanorama = 256});
    how.variants.push_back({"--thin 0", [](Settings& s) { s.thin = 0; }});
    return finished(std::move(knob), how);
}

Knob strokes()
{
    Knob knob;
    knob.name = "strokes";
    knob.title = "strokes: rendered N x N times as large and averaged";
    knob.unit = "times";
    knob.against = "the same drops, all within 6 m, sampled 24 x 24 times a pixel";
    knob.values = {1, 2, 3, 4, 6};
    knob.standard = 1;
    PictureKnob how;
    how.prepare = [](Settings& s) {
        s.far_m = 6;
        s.threshold = 1e-5;
        s.thin = 0;  // the same drops at every size
        s.fog_1_m = 0;
    };
    how.render = [](const Clip& clip, const Settings& s, double value) { return supersampled(clip, s, int(value)); };
    how.truth = byReference({.allDrops = false, .samples = 24, .widestPanorama = 256});
    return finished(std::move(knob), how);
}

constexpr double automaticOrder = -1;

Knob order()
{
    Knob knob;
    knob.name = "env-order";
    knob.title = "--env-order";
    knob.against = "the panorama integrated for each pixel; 400 mm/h without fog, so that the strokes' light counts";
    knob.values = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 24, 32, 64, automaticOrder};
    knob.standard = automaticOrder;
    knob.standardVariant = "auto";
    PictureKnob how;
    how.automatic = automaticOrder;
    how.hasSeeds = false;
    how.prepare = [](Settings& s) {
        s.rate_mm_h = 400;
        s.fog_1_m = 0;
        s.threshold = 0.005;
    };
    how.render = [](const Clip& clip, Settings s, double value) {
        if (value != automaticOrder) s.envOrder = value;
        return renderClip(clip, s);
    };
    how.truth = byReference({.allDrops = false, .samples = 16, .widestPanorama = 1024});
    return finished(std::move(knob), how);
}

Knob blur()
{
    Knob knob;
    knob.name = "blur";
    knob.title = "--blur, which is off by default: two passes out to 3 sigma";
    knob.unit = "px";
    knob.against = "one sum over both directions out to 5 sigma";
    knob.values = {0.25, 0.5, 1, 2, 4, 8};
    knob.standard = 2;
    PictureKnob how;
    how.hasSeeds = how.hasRain = false;
    how.prepare = [](Settings& s) { s.rate_mm_h = 0; };
    how.render = [](const Clip& clip, Settings s, double value) {
        s.blur_px = value;
        return renderClip(clip, s);
    };
    how.truth = [](const Clip& clip, Settings s, double value) {
        s.blur_px = value;
        return renderTruth(clip, s, {});
    };
    how.isOneTruth = false;
    return finished(std::move(knob), how);
}

Knob layers()
{
    Knob knob;
    knob.name = "layers";
    knob.title = "layers stored with so many bits of mantissa (10: half, 23: float) and laid over one another";
    knob.unit = "bits";
    knob.against = "the beauty";
    knob.values = {7, 8, 9, 10, 12, 16, 23};
    knob.standard = 10;
    PictureKnob how;
    how.hasRain = false;
    how.render = [](const Clip& clip, const Settings& s, double value) { return recombined(clip, s, int(value)); };
    how.truth = [](const Clip& clip, const Settings& s, double) { return renderClip(clip, s); };
    return finished(std::move(knob), how);
}

}  // namespace

std::vector<Knob> pictureKnobs() { return {threshold(), strokes(), order(), blur(), layers()}; }

}  // namespace virga::bench
