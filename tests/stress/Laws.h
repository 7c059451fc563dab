// What holds of every frame, whatever the settings: the laws of the stress suite.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string>

#include "io/Plate.h"

namespace virga::stress {

/// The most light that anything in a scene has [scene-linear]: no pixel of a picture is brighter.
struct Ceiling {
    double light = 1;
    double least = 0;     ///< the plate's own least: what is below 0 there may stay so
    bool isKnown = true;  ///< false: lamps, colour transfer and the paper's mode make light that no one number bounds
};

/// A series that is cut off overshoots a jump by 9 % of it (Gibbs 1899): so do drops lit by harmonics.
constexpr double overshoot = 1.09;

/// Rounding: layers are kept in half precision, and many strokes add up.
constexpr float slack = 2e-3f;

/// The first law that `frame` breaks, with the place and the value; empty if none. `isOpaque`: the plate was.
inline std::string brokenLaw(const io::RenderedFrame& frame, const Ceiling& ceiling, bool isOpaque)
{
    const auto lookAt = [&](const std::string& name, const ImageF& pixels, bool isData) -> std::string {
        for (int y = 0; y < pixels.height(); ++y)
            for (int x = 0; x < pixels.width(); ++x)
                for (int c = 0; c < pixels.channels(); ++c) {
                    const float value = pixels.at(x, y, c);
                    const auto breaks = [&](const char* law) {
                        return fmt::format("{} at ({}, {}), channel {}: {} {}", name, x, y, c, value, law);
                    };
                    if (std::isnan(value)) return breaks("is no number");
                    if (isData) continue;
                    if (!std::isfinite(value)) return breaks("is not finite");
                    if (value < (c == 3 ? 0 : ceiling.least) * (1 + slack)) return breaks("is negative");
                    if (c == 3 && value > 1 + slack) return breaks("is an alpha over 1");
                    if (c < 3 && ceiling.isKnown && value > overshoot * ceiling.light * (1 + slack))
                        return breaks(fmt::format("is brighter than all there is, {}", ceiling.light).c_str());
                }
        return {};
    };
    std::string broken = lookAt("beauty", frame.beauty, false);
    if (broken.empty() && isOpaque)
        for (int y = 0; y < frame.beauty.height(); ++y)
            for (int x = 0; x < frame.beauty.width(); ++x)
                if (frame.beauty.at(x, y, 3) != 1)
                    return fmt::format("beauty at ({}, {}): alpha {} of an opaque plate", x, y,
                                       frame.beauty.at(x, y, 3));
    for (const io::Layer& layer : frame.layers) {
        if (!broken.empty()) break;
        broken = lookAt(layer.name, layer.pixels, layer.isData);
        if (layer.name == "rain" && layer.isData)
            for (std::size_t i = 0; i < layer.pixels.size(); ++i)
                if (!(layer.pixels.data()[i] > 0)) return fmt::format("rain.Z holds {}", layer.pixels.data()[i]);
        if (layer.name == "rain.motion")
            for (std::size_t i = 0; i < layer.pixels.size(); ++i)
                if (!std::isfinite(layer.pixels.data()[i]))
                    return fmt::format("rain.motion holds {}", layer.pixels.data()[i]);
    }
    return broken;
}

}  // namespace virga::stress
