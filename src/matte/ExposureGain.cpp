#include "matte/ExposureGain.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace virga::matte {
namespace {

constexpr int rounds = 3;
constexpr std::size_t mostSamples = 20'000;  // pixels; the median of so many is known to 0.3 % of its spread
constexpr double darkest = 1e-3;             // of the brightest sample: below it a ratio is noise

float medianOf(std::vector<float>& values)
{
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

std::vector<double> exposureGains(std::span<const ImageF> frames)
{
    if (frames.empty()) return {};
    const std::size_t channels = std::size_t(frames[0].channels()), pixels = frames[0].size() / channels;
    // A stride that is odd walks through all columns and rows.
    const std::size_t stride = pixels / mostSamples + 1 + (pixels / mostSamples) % 2;
    std::vector<double> gains(frames.size() * channels, 1.0);
    std::vector<float> history(frames.size()), scene, ratios;
    for (std::size_t c = 0; c < channels; ++c) {
        for (int round = 0; round < rounds; ++round) {
            scene.clear();
            for (std::size_t i = 0; i < pixels; i += stride) {
                for (std::size_t k = 0; k < frames.size(); ++k)
                    history[k] = float(frames[k].data()[i * channels + c] / gains[k * channels + c]);
                scene.push_back(medianOf(history));
            }
            const float least = float(darkest) * *std::max_element(scene.begin(), scene.end());
            double mean = 0.0;
            for (std::size_t k = 0; k < frames.size(); ++k) {
                ratios.clear();
                for (std::size_t n = 0; n < scene.size(); ++n)
                    if (scene[n] > least) ratios.push_back(frames[k].data()[n * stride * channels + c] / scene[n]);
                double gain = ratios.empty() ? 1.0 : double(medianOf(ratios));
                if (!(gain > 0.0) || !std::isfinite(gain)) gain = 1.0;
                gains[k * channels + c] = gain;
                mean += std::log(gain) / double(frames.size());
            }
            for (std::size_t k = 0; k < frames.size(); ++k) gains[k * channels + c] /= std::exp(mean);
        }
    }
    return gains;
}

void applyGain(ImageF& frame, std::span<const double> gains)
{
    assert(gains.size() == std::size_t(frame.channels()));
    for (std::size_t i = 0; i < frame.size(); ++i) frame.data()[i] *= float(gains[i % gains.size()]);
}

void removeGain(ImageF& frame, std::span<const double> gains)
{
    assert(gains.size() == std::size_t(frame.channels()));
    for (std::size_t i = 0; i < frame.size(); ++i) frame.data()[i] /= float(gains[i % gains.size()]);
}

}  // namespace virga::matte
