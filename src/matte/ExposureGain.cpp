#include "matte/ExposureGain.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/Parallel.h"
#include "matte/TemporalMedian.h"

namespace virga::matte {
namespace {

constexpr int rounds = 3;
constexpr std::size_t mostSamples = 20'000;  // pixels; the median of so many is known to 0.3 % of its spread
constexpr double darkest = 1e-3;             // of the brightest sample: below it a ratio is noise

float brightest(const float* row, int count)
{
    float most = row[0];
    for (int i = 1; i < count; ++i) most = most < row[i] ? row[i] : most;
    return most;
}

/// The row times `factors`, which has as many values and repeats itself.
void scaleRow(float* __restrict row, const float* __restrict factors, int count)
{
    for (int i = 0; i < count; ++i) row[i] *= factors[i];
}

template <class Factor>
void scale(ImageF& frame, std::span<const double> gains, const Factor& factor)
{
    assert(gains.size() == std::size_t(frame.channels()));
    const int count = frame.width() * frame.channels();
    std::vector<float> factors(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < factors.size(); ++i) factors[i] = float(factor(gains[i % gains.size()]));
    parallelFor(0, frame.height(), 64, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) scaleRow(frame.row(y), factors.data(), count);
    });
}

/// The upper one of an even number. What lies outside two quantiles of a few of the values is only counted (after Floyd
/// & Rivest 1975), which leaves a tenth to sort.
float medianOf(std::vector<float>& values)
{
    constexpr std::size_t few = 400;
    const std::size_t rank = values.size() / 2;
    if (values.size() > 10 * few) {
        std::vector<float> some(few);
        for (std::size_t n = 0; n < few; ++n) some[n] = values[n * values.size() / few];
        std::sort(some.begin(), some.end());
        const float low = some[few * 45 / 100], high = some[few * 55 / 100];
        std::vector<float> between(values.size());
        std::size_t below = 0, count = 0;
        for (const float value : values) {
            below += value < low;
            between[count] = value;
            count += value >= low && value <= high;
        }
        if (below <= rank && rank < below + count) {
            const auto middle = between.begin() + std::ptrdiff_t(rank - below);
            std::nth_element(between.begin(), middle, between.begin() + std::ptrdiff_t(count));
            return *middle;
        }
    }
    const auto middle = values.begin() + std::ptrdiff_t(rank);
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
    const std::size_t count = (pixels + stride - 1) / stride;
    const auto overFrames = [&](const auto& body) {
        parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto k = std::size_t(first); k < std::size_t(last); ++k) body(k);
        });
    };
    // Row c of a picture of samples has channel c.
    std::vector<ImageF> samples(frames.size(), ImageF(int(count), int(channels), 1)), still = samples;
    overFrames([&](std::size_t k) {
        for (std::size_t n = 0; n < count; ++n)
            for (std::size_t c = 0; c < channels; ++c)
                samples[k].data()[c * count + n] = frames[k].data()[n * stride * channels + c];
    });

    std::vector<double> gains(frames.size() * channels, 1.0);
    for (int round = 0; round < rounds; ++round) {
        overFrames([&](std::size_t k) {
            for (std::size_t c = 0; c < channels; ++c) {
                const float* from = samples[k].row(int(c));
                const float inverse = float(1.0 / gains[k * channels + c]);
                std::transform(from, from + count, still[k].row(int(c)), [&](float value) { return value * inverse; });
            }
        });
        const ImageF scene = temporalMedian(still);
        std::vector<float> least;
        for (std::size_t c = 0; c < channels; ++c)
            least.push_back(float(darkest) * brightest(scene.row(int(c)), int(count)));
        overFrames([&](std::size_t k) {
            std::vector<float> ratios(count);
            for (std::size_t c = 0; c < channels; ++c) {
                const float *sample = samples[k].row(int(c)), *level = scene.row(int(c));
                std::size_t usable = 0;
                ratios.resize(count);
                for (std::size_t n = 0; n < count; ++n) {
                    ratios[usable] = sample[n] / level[n];
                    usable += level[n] > least[c];
                }
                ratios.resize(usable);
                const double gain = ratios.empty() ? 1.0 : double(medianOf(ratios));
                gains[k * channels + c] = gain > 0.0 && std::isfinite(gain) ? gain : 1.0;
            }
        });
        for (std::size_t c = 0; c < channels; ++c) {
            double mean = 0.0;
            for (std::size_t k = 0; k < frames.size(); ++k)
                mean += std::log(gains[k * channels + c]) / double(frames.size());
            for (std::size_t k = 0; k < frames.size(); ++k) gains[k * channels + c] /= std::exp(mean);
        }
    }
    return gains;
}

void applyGain(ImageF& frame, std::span<const double> gains)
{
    scale(frame, gains, [](double gain) { return gain; });
}

void removeGain(ImageF& frame, std::span<const double> gains)
{
    scale(frame, gains, [](double gain) { return 1.0 / gain; });
}

}  // namespace virga::matte
