// Footage whose rain is known: strokes with straight sides over a scene of smooth bumps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "core/Image.h"

namespace virga::bench {

struct DrawnRain {
    ImageF scene;
    std::vector<ImageF> frames, alphas;
};

struct DrawnRainOptions {
    int width = 96, height = 96, frames = 10, strokes = 15;
    double slant = 0.0;    // [rad]
    double noise = 0.0;    // standard deviation in the frames
    double texture = 0.0;  // standard deviation of what the scene has from pixel to pixel, beside its bumps
    std::array<float, 3> color = {0.78f, 0.80f, 0.82f};
    unsigned seed = 1;
};

/// Strokes of 12 to 40 x 1 to 3 px and alpha 0.1 to 0.5, each pixel the mean of 4 x 4 points.
inline DrawnRain drawRain(const DrawnRainOptions& options)
{
    std::mt19937 engine(options.seed);
    const auto uniform = [&](double low, double high) {
        return low + (high - low) * (double(engine() >> 8) / double(1 << 24));
    };
    const auto normal = [&] {
        return std::sqrt(-2.0 * std::log(1.0 - uniform(0, 1))) * std::cos(6.283185307179586 * uniform(0, 1));
    };
    const int width = options.width, height = options.height;
    DrawnRain drawn;
    drawn.scene = ImageF(width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int j = 0; j < 3; ++j)
                drawn.scene.at(x, y, j) =
                    float(0.3 + 0.1 * std::sin(x * 0.13 + j) * std::cos(y * 0.09) + 0.05 * std::sin(x * 0.4 + y * 0.3));
    if (options.texture > 0.0)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto grain = float(options.texture * normal());
                for (int j = 0; j < 3; ++j) drawn.scene.at(x, y, j) = std::max(drawn.scene.at(x, y, j) + grain, 0.02f);
            }
    const double s = std::sin(options.slant), c = std::cos(options.slant);
    for (int k = 0; k < options.frames; ++k) {
        ImageF alpha(width, height, 1);
        for (int n = 0; n < options.strokes; ++n) {
            const double cx = uniform(0, width), cy = uniform(0, height);
            const double halfLength = uniform(6, 20), halfWidth = uniform(0.5, 1.5), peak = uniform(0.1, 0.5);
            const int reach = int(halfLength) + 3;
            for (int y = std::max(0, int(cy) - reach); y < std::min(height, int(cy) + reach); ++y)
                for (int x = std::max(0, int(cx) - reach); x < std::min(width, int(cx) + reach); ++x) {
                    int inside = 0;
                    for (int p = 0; p < 16; ++p) {
                        const double dx = x + (p % 4 + 0.5) / 4 - cx, dy = y + (p / 4 + 0.5) / 4 - cy;
                        inside += std::abs(dx * c - dy * s) < halfWidth && std::abs(dx * s + dy * c) < halfLength;
                    }
                    alpha.at(x, y) = std::max(alpha.at(x, y), float(peak * inside / 16));
                }
        }
        ImageF frame(width, height, 3);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int j = 0; j < 3; ++j)
                    frame.at(x, y, j) = (1 - alpha.at(x, y)) * drawn.scene.at(x, y, j) +
                                        alpha.at(x, y) * options.color[std::size_t(j)] +
                                        float(options.noise * normal());
        drawn.frames.push_back(std::move(frame));
        drawn.alphas.push_back(std::move(alpha));
    }
    return drawn;
}

}  // namespace virga::bench
