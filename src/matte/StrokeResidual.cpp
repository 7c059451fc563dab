#include "matte/StrokeResidual.h"

#include <algorithm>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/PixelRows.h"

namespace virga::matte {
namespace {

constexpr double dryLimit = 2.0;  // [sigma] of the channels' mean, for a sample that says what is behind
constexpr std::size_t enoughPixels = 2'500'000, fewestFrames = 6;  // that samples are looked for in
constexpr float leastTrust = 0.5f;

/// Adds the values that are dry, `mask` 1 or 0.
VIRGA_SIMD void addMasked(const float* __restrict values, const float* __restrict mask, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] += mask[i] * values[i];
}

VIRGA_SIMD void markDry(const float* __restrict mean, const float* __restrict trusted, float limit, int count,
                        float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = ((std::abs(mean[i]) <= limit) & (trusted[i] > leastTrust)) ? 1.0f : 0.0f;
}

VIRGA_SIMD void markWet(const float* __restrict mean, const float* __restrict trusted, const float* __restrict limits,
                        int count, char* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = char((std::abs(mean[i]) > limits[i]) & (trusted[i] > leastTrust));
}

}  // namespace

StrokeResidual::StrokeResidual(const Footage& footage, const ImageF& scene, double sigma, double brightest)
    : width(scene.width()), height(scene.height()), channels(scene.channels()), footage_(footage), scene_(scene),
      sums_(width, height, channels), counts_(width, height, 1), limit_(float(dryLimit * sigma)),
      brightest_(float(brightest))
{
    const std::size_t all = footage.frames.size(), pixels = counts_.size();
    const std::size_t count = std::min(all, std::max(fewestFrames, enoughPixels / pixels));
    for (std::size_t n = 0; n < count; ++n) {
        which_.push_back((2 * n + 1) * all / (2 * count));
        means_.emplace_back(width, height, 1);
    }
    parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        const std::vector<float> ones(std::size_t(width), 1.0f);
        std::vector<float> mean(ones), dry(ones), dryValues(std::size_t(width * channels));
        for (int y = int(first); y < int(last); ++y)
            for (std::size_t k = 0, n = 0; k < all; ++k) {
                const bool isOurs = n < count && which_[n] == k;
                float* means = isOurs ? means_[n++].row(y) : mean.data();
                meanDifference(footage.frames[k].row(y), scene.row(y), channels, std::size_t(width), means);
                markDry(means, footage.trust.empty() ? ones.data() : footage.trust[k].row(y), limit_, width,
                        dry.data());
                repeatRow(dry.data(), width, channels, dryValues.data());
                addMasked(footage.frames[k].row(y), dryValues.data(), width * channels, sums_.row(y));
                addMasked(ones.data(), dry.data(), width, counts_.row(y));
            }
    });
}

Image<char> StrokeResidual::wet(std::size_t n, const ImageF& limits) const
{
    Image<char> wet(width, height, 1);
    const std::vector<float> ones(std::size_t(width), 1.0f);
    for (int y = 0; y < height; ++y)
        markWet(means_[n].row(y), footage_.trust.empty() ? ones.data() : footage_.trust[which_[n]].row(y),
                limits.row(y), width, wet.row(y));
    return wet;
}

}  // namespace virga::matte
