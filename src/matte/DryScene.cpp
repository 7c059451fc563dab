#include "matte/DryScene.h"

#include <algorithm>
#include <numeric>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/PixelRows.h"
#include "matte/SceneTrust.h"
#include "matte/TemporalMedian.h"

namespace virga::matte {
namespace {

constexpr double darkLimit = 2.5, brightLimit = 2.0;  // [sigma]
constexpr float fewestDry = 3.0f;
constexpr int trimmings = 3;
constexpr double mostMoving = 0.25, leastMoving = 0.02;  // of all samples
constexpr std::size_t fewestForMovers = 5;
constexpr double leastNoise = 1e-4;      // of the range
constexpr double leastStep = 0.5 / 255;  // of the range: less is no evidence that something moves

/// What is bright in the footage: the 99th percentile of the scene's values; less than a hundredth may be lamps.
double rangeOf(const ImageF& scene)
{
    const std::size_t stride = scene.size() / 100'000 + 1;
    std::vector<float> values;
    for (std::size_t i = 0; i < scene.size(); i += stride) values.push_back(scene.data()[i]);
    const auto at = values.begin() + std::ptrdiff_t((values.size() - 1) * 99 / 100);
    std::nth_element(values.begin(), at, values.end());
    return *at > 0.0f ? double(*at) : 1.0;
}

VIRGA_SIMD void setLimits(const float* __restrict row, const float* __restrict sigma, std::size_t count,
                          float* __restrict low, float* __restrict high)
{
    for (std::size_t n = 0; n < count; ++n) {
        low[n] = row[n] - float(darkLimit) * sigma[n];
        high[n] = row[n] + float(brightLimit) * sigma[n];
    }
}

/// Adds what lies within the limits.
VIRGA_SIMD void addWithin(const float* __restrict values, const float* __restrict low, const float* __restrict high,
                          const float* __restrict trusted, float* __restrict sum, float* __restrict weight,
                          std::size_t count)
{
    for (std::size_t n = 0; n < count; ++n) {
        const float w = (values[n] > low[n]) & (values[n] < high[n]) ? trusted[n] : 0.0f;
        sum[n] += w * values[n];
        weight[n] += w;
    }
}

VIRGA_SIMD void setMeans(const float* __restrict sum, const float* __restrict weight, std::size_t count,
                         float* __restrict row)
{
    for (std::size_t n = 0; n < count; ++n) row[n] = weight[n] >= fewestDry ? sum[n] / weight[n] : row[n];
}

/// The scene as the mean of what is dry, where there are three such values at least.
/// least  no deviation is taken for less
void trimScene(std::span<const ImageF> frames, std::span<const ImageF> trust, const NoiseMap& noise, double least,
               ImageF& scene)
{
    const int width = scene.width(), channels = scene.channels();
    const auto count = std::size_t(width) * std::size_t(channels);
    parallelFor(0, scene.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<float> sum(count), weight(count), low(count), high(count), sigmas(count), trusted(count, 1.0f);
        std::vector<float> sigma(static_cast<std::size_t>(width));
        for (int y = int(first); y < int(last); ++y) {
            float* row = scene.row(y);
            for (int x = 0; x < width; x += NoiseMap::block)
                std::fill(sigma.begin() + x, sigma.begin() + std::min(x + NoiseMap::block, width),
                          std::max(noise.at(x, y), float(least)));
            repeatRow(sigma.data(), width, channels, sigmas.data());
            setLimits(row, sigmas.data(), count, low.data(), high.data());
            std::fill(sum.begin(), sum.end(), 0.0f);
            std::fill(weight.begin(), weight.end(), 0.0f);
            for (std::size_t k = 0; k < frames.size(); ++k) {
                if (!trust.empty()) repeatRow(trust[k].row(y), width, channels, trusted.data());
                addWithin(frames[k].row(y), low.data(), high.data(), trusted.data(), sum.data(), weight.data(), count);
            }
            setMeans(sum.data(), weight.data(), count, row);
        }
    });
}

double untrustedShare(std::span<const ImageF> trust)
{
    std::vector<double> sums(trust.size(), 0.0);
    parallelFor(0, std::ptrdiff_t(trust.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            for (int y = 0; y < trust[k].height(); ++y) {
                float row = 0.0f;
                for (int x = 0; x < trust[k].width(); ++x) row += 1.0f - trust[k].row(y)[x];
                sums[k] += row;
            }
    });
    const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
    return trust.empty() ? 0.0 : sum / (double(trust.size()) * double(trust[0].size()));
}

/// Of the trusted samples, those that are more than four deviations darker than the scene in any channel.
double shareBelow(std::span<const ImageF> frames, const DryScene& dry)
{
    const int width = dry.scene.width(), channels = dry.scene.channels();
    std::vector<double> below(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            for (int y = 0; y < dry.scene.height(); ++y)
                for (int x = 0; x < width; ++x) {
                    const float limit = 4.0f * std::max(dry.noise.at(x, y), float(leastStep * dry.range));
                    bool isBelow = false;
                    for (int j = 0; j < channels; ++j) isBelow |= frames[k].at(x, y, j) < dry.scene.at(x, y, j) - limit;
                    below[k] += isBelow;
                }
    });
    double sum = 0.0;
    for (const double count : below) sum += count;
    return sum / (double(frames.size()) * double(width) * double(dry.scene.height()));
}

void measureNoise(std::span<const ImageF> frames, const ImageF& own, NoiseSamples samples, DryScene& dry)
{
    dry.noise = noiseMap(frames, dry.trust, dry.scene, leastNoise * dry.range, leastStep * dry.range, samples, &own);
}

/// Scene and noise from `scene`, in turn. The last noise, which is handed out, is still to be measured.
void settle(std::span<const ImageF> frames, const ImageF& own, DryScene& dry)
{
    for (int pass = 0; pass < trimmings; ++pass) {
        measureNoise(frames, own, NoiseSamples::Few, dry);
        trimScene(frames, dry.trust, dry.noise, 0.0, dry.scene);
    }
}

}  // namespace

DryScene dryScene(std::span<const ImageF> frames, bool movers, const ImageF& start, std::span<const ImageF> covered)
{
    DryScene dry;
    const ImageF begin = start.empty() ? shorterHalfMean(frames) : start;
    dry.range = rangeOf(begin);
    dry.scene = begin;
    dry.trust.assign(covered.begin(), covered.end());
    const ImageF own = ownFrames(frames, leastStep * dry.range);
    settle(frames, own, dry);
    dry.hasMovers = movers && frames.size() >= fewestForMovers;
    renewTrust(frames, dry.scene, covered, dry);
    if (!dry.hasMovers) {
        measureNoise(frames, own, NoiseSamples::Many, dry);
        return dry;
    }

    // Something is darker than the scene. Either it moves, or the scene is rain, where that covers a pixel most of the
    // time: then a darker scene explains everything, as nothing but what moves is darker than that.
    DryScene darker{lowerQuarterMean(frames), {}, {covered.begin(), covered.end()}, true, dry.range};
    // The noise about the first scene may be rain as well. About this one, which lies a deviation low, half of it
    // shows.
    measureNoise(frames, own, NoiseSamples::Few, darker);
    for (std::size_t i = 0; i < darker.noise.sigma.size(); ++i)
        darker.noise.sigma.data()[i] = std::min(2.0f * darker.noise.sigma.data()[i], dry.noise.sigma.data()[i]);
    for (int pass = 0; pass < trimmings; ++pass)
        trimScene(frames, darker.trust, darker.noise, leastStep * dry.range, darker.scene);
    darker.hasMovers = somethingMoves(frames, darker.scene, leastStep * dry.range);
    if (darker.hasMovers) {
        dry.scene = begin;
        settle(frames, own, dry);
        measureNoise(frames, own, NoiseSamples::Many, dry);
        renewTrust(frames, dry.scene, covered, dry);
        // Nearly everything moves, or the scene is rain after all: then next to nothing is darker than the darker one.
        if (untrustedShare(dry.trust) < mostMoving) return dry;
    }
    measureNoise(frames, own, NoiseSamples::Many, darker);
    if (darker.hasMovers && shareBelow(frames, darker) > leastMoving) return dry;
    darker.hasMovers = false;
    return darker;
}

void renewTrust(std::span<const ImageF> frames, const ImageF& scene, std::span<const ImageF> covered, DryScene& dry)
{
    if (!dry.hasMovers) return;
    dry.trust.clear();  // before there is another
    std::vector<ImageF> trust = sceneTrust(frames, scene, leastStep * dry.range);
    dry.hasMovers = !trust.empty();
    if (!dry.hasMovers) {
        dry.trust.assign(covered.begin(), covered.end());
        return;
    }
    for (std::size_t k = 0; k < covered.size(); ++k)
        for (std::size_t i = 0; i < trust[k].size(); ++i) trust[k].data()[i] *= covered[k].data()[i];
    dry.trust = std::move(trust);
}

}  // namespace virga::matte
