#include "Knob.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "shot/Compositor.h"

namespace bench {
namespace {

using namespace virga;
using shot::Settings;

ImageF layerOf(const io::RenderedFrame& frame, const std::string& name)
{
    for (const io::Layer& layer : frame.layers)
        if (layer.name == name && layer.channels.size() == 4) return layer.pixels;
    return ImageF(frame.beauty.width(), frame.beauty.height(), 4);
}

Measured measuredOf(const io::RenderedFrame& frame)
{
    Measured measured{.beauty = frame.beauty, .effect = frame.beauty};
    const ImageF plate = layerOf(frame, "plate");
    for (std::size_t i = 0; i < plate.size(); ++i) measured.effect.data()[i] -= plate.data()[i];
    return measured;
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

auto byReference(const shot::ReferenceOptions& options)
{
    return [options](const Clip& clip, const Settings& s, double) { return renderTruth(clip, s, options); };
}

Knob threshold(double opacity)
{
    Knob knob;
    knob.name = opacity == 5 ? "threshold" : fmt::format("threshold_opacity_{:g}", opacity);
    knob.title = fmt::format("--threshold at --opacity {:g}", opacity);
    knob.against = "every drop within 16 m drawn, none folded into fog";
    knob.values = {0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0003, 0.0001};
    knob.standard = 0.02;
    knob.prepare = [opacity](Settings& s) {
        s.far_m = 16;
        s.opacity = opacity;
    };
    knob.render = [](const Clip& clip, Settings s, double value) {
        s.threshold = value;
        return renderClip(clip, s);
    };
    knob.truth = byReference({.allDrops = true, .samples = 6, .widestPanorama = 256});
    knob.onFootage = opacity == 5;
    return knob;
}

}  // namespace

Measured renderClip(const Clip& clip, const Settings& settings)
{
    shot::Compositor compositor(settings, clip.shot, {.wanted = {.layers = true}, .device = "cpu", .shaderFolder = {}},
                                {});
    Measured measured = measuredOf(compositor.render(clip.frame));
    std::vector<double> ms;
    for (int i = 0; i < 5; ++i) {
        const double before = compositor.statistics().renderSeconds;
        compositor.render(clip.frame);
        ms.push_back(1e3 * (compositor.statistics().renderSeconds - before));
    }
    std::nth_element(ms.begin(), ms.begin() + 2, ms.end());
    measured.ms = ms[2];
    return measured;
}

Measured renderTruth(const Clip& clip, const Settings& settings, const shot::ReferenceOptions& options)
{
    shot::ReferenceRenderer reference(settings, clip.shot, {.layers = true}, {}, options);
    Measured measured = measuredOf(reference.render(clip.frame));
    measured.ms = 1e3 * reference.statistics().renderSeconds;
    return measured;
}

std::vector<Knob> knobs()
{
    std::vector<Knob> all = {threshold(5), threshold(2), threshold(1)};

    Knob strokes;
    strokes.name = "strokes";
    strokes.title = "strokes: rendered N x N times as large and averaged";
    strokes.unit = "times";
    strokes.against = "the same drops, all within 6 m, sampled 24 x 24 times a pixel";
    strokes.values = {1, 2, 3, 4, 6};
    strokes.standard = 1;
    strokes.prepare = [](Settings& s) {
        s.far_m = 6;
        s.threshold = 1e-5;
        s.fog_1_m = 0;
    };
    strokes.render = [](const Clip& clip, const Settings& s, double value) {
        return supersampled(clip, s, int(value));
    };
    strokes.truth = byReference({.allDrops = false, .samples = 24, .widestPanorama = 256});
    all.push_back(strokes);

    Knob order;
    order.name = "env-order";
    order.title = "--env-order, which auto takes for 8 here";
    order.against = "the panorama integrated for each pixel; 400 mm/h without fog, so that the strokes' light counts";
    order.values = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 24, 32, 64};
    order.standard = 8;
    order.hasSeeds = false;
    order.prepare = [](Settings& s) {
        s.rate_mm_h = 400;
        s.fog_1_m = 0;
        s.threshold = 0.005;
    };
    order.render = [](const Clip& clip, Settings s, double value) {
        s.envOrder = value;
        return renderClip(clip, s);
    };
    order.truth = byReference({.allDrops = false, .samples = 16, .widestPanorama = 1024});
    all.push_back(order);

    Knob blur;
    blur.name = "blur";
    blur.title = "--blur, which is off by default: two passes out to 3 sigma";
    blur.unit = "px";
    blur.against = "one sum over both directions out to 5 sigma";
    blur.values = {0.25, 0.5, 1, 2, 4, 8};
    blur.standard = 2;
    blur.hasSeeds = false;
    blur.onFootage = true;
    blur.prepare = [](Settings& s) { s.rate_mm_h = 0; };
    blur.render = [](const Clip& clip, Settings s, double value) {
        s.blur_px = value;
        return renderClip(clip, s);
    };
    blur.truth = [](const Clip& clip, Settings s, double value) {
        s.blur_px = value;
        return renderTruth(clip, s, {});
    };
    blur.isOneTruth = false;
    all.push_back(blur);

    Knob layers;
    layers.name = "layers";
    layers.title = "layers stored with so many bits of mantissa (10: half, 23: float) and laid over one another";
    layers.unit = "bits";
    layers.against = "the beauty";
    layers.values = {7, 8, 9, 10, 12, 16, 23};
    layers.standard = 10;
    layers.prepare = [](Settings&) {};
    layers.render = [](const Clip& clip, const Settings& s, double value) { return recombined(clip, s, int(value)); };
    layers.truth = [](const Clip& clip, const Settings& s, double) { return renderClip(clip, s); };
    layers.onFootage = true;
    all.push_back(layers);
    return all;
}

}  // namespace bench
