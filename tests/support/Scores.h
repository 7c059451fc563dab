// Scores of derained footage beside the footage without rain, and of alphas beside true ones. Frames are
// display-referred values, white 1, all of one size; both sides have as many frames and channels. Scores of footage are
// means over frames.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/Image.h"
#include "core/Parallel.h"

namespace virga::test {

/// Root of the mean square of a - b, over everything.
inline double rootMeanSquare(const std::vector<ImageF>& a, const std::vector<ImageF>& b)
{
    assert(a.size() == b.size());
    double square = 0, count = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        assert(a[k].size() == b[k].size());
        for (std::size_t i = 0; i < a[k].size(); ++i) square += std::pow(double(a[k].data()[i]) - b[k].data()[i], 2);
        count += double(a[k].size());
    }
    return std::sqrt(square / count);
}
inline double rootMeanSquare(const ImageF& a, const ImageF& b)
{
    return rootMeanSquare(std::vector<ImageF>{a}, std::vector<ImageF>{b});
}

/// [dB] against white; values are clipped to 0..1 first. Infinite if a frame is met exactly.
inline double peakSignalToNoise(const std::vector<ImageF>& a, const std::vector<ImageF>& b)
{
    assert(a.size() == b.size());
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        double square = 0;
        for (std::size_t i = 0; i < a[k].size(); ++i) {
            const double p = std::clamp(a[k].data()[i], 0.0f, 1.0f), q = std::clamp(b[k].data()[i], 0.0f, 1.0f);
            square += (p - q) * (p - q);
        }
        sum += -10 * std::log10(square / double(a[k].size())) / double(a.size());
    }
    return sum;
}

/// Wang, Bovik, Sheikh & Simoncelli 2004: 11 x 11 Gaussian of sigma 1.5, K = 0.01 and 0.03, L = 1, whole windows only
/// (5 px at the border have no score), the mean over channels. Values are clipped to 0..1 first. At least 11 x 11
/// pixels.
inline double structuralSimilarity(const ImageF& a, const ImageF& b)
{
    constexpr int window = 11;
    const int width = a.width(), height = a.height(), channels = a.channels();
    const int inner = width - window + 1, rows = height - window + 1;
    assert(inner > 0 && rows > 0 && a.size() == b.size());
    std::array<double, window> kernel;
    double total = 0;
    for (int t = 0; t < window; ++t) total += kernel[std::size_t(t)] = std::exp(-std::pow((t - 5) / 1.5, 2) / 2);
    for (double& weight : kernel) weight /= total;

    using Moments = std::array<double, 5>;  // weighted means of p, q, pp, qq, pq
    std::vector<Moments> along(std::size_t(inner) * std::size_t(height));
    double sum = 0;
    for (int c = 0; c < channels; ++c) {
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < inner; ++x) {
                Moments& m = along[std::size_t(y) * std::size_t(inner) + std::size_t(x)] = {};
                for (int t = 0; t < window; ++t) {
                    const double w = kernel[std::size_t(t)], p = std::clamp(a.at(x + t, y, c), 0.0f, 1.0f),
                                 q = std::clamp(b.at(x + t, y, c), 0.0f, 1.0f);
                    m[0] += w * p;
                    m[1] += w * q;
                    m[2] += w * p * p;
                    m[3] += w * q * q;
                    m[4] += w * p * q;
                }
            }
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < inner; ++x) {
                Moments m{};
                for (int t = 0; t < window; ++t) {
                    const Moments& row = along[std::size_t(y + t) * std::size_t(inner) + std::size_t(x)];
                    for (std::size_t i = 0; i < m.size(); ++i) m[i] += kernel[std::size_t(t)] * row[i];
                }
                const auto [p, q, pp, qq, pq] = m;
                sum += (2 * p * q + 1e-4) * (2 * (pq - p * q) + 9e-4) /
                       ((p * p + q * q + 1e-4) * (pp - p * p + qq - q * q + 9e-4));
            }
    }
    return sum / (double(channels) * inner * rows);
}

inline double structuralSimilarity(const std::vector<ImageF>& a, const std::vector<ImageF>& b)
{
    assert(a.size() == b.size());
    std::vector<double> scores(a.size());
    parallelFor(0, std::ptrdiff_t(a.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) scores[k] = structuralSimilarity(a[k], b[k]);
    });
    double sum = 0;
    for (const double score : scores) sum += score;
    return sum / double(scores.size());
}

/// Pixels found beside pixels that are true, over all frames.
struct Detection {
    double both = 0, found = 0, truth = 0;

    void add(bool isFound, bool isTrue)
    {
        both += isFound && isTrue;
        found += isFound;
        truth += isTrue;
    }
    double precision() const { return found > 0 ? both / found : 0; }
    double recall() const { return truth > 0 ? both / truth : 0; }
    /// Harmonic mean of the two; 0 where nothing is found or nothing true.
    double f() const { return found + truth > 0 ? 2 * both / (found + truth) : 0; }
};

/// Streak pixels: the mean over channels is more than 5/255 above the one without rain. The hair over 5 keeps out
/// differences of exactly 5 between 8-bit codes, which floats round to either side.
inline Detection streakDetection(const std::vector<ImageF>& rainy, const std::vector<ImageF>& derained,
                                 const std::vector<ImageF>& clean)
{
    assert(rainy.size() == derained.size() && rainy.size() == clean.size());
    Detection result;
    for (std::size_t k = 0; k < rainy.size(); ++k) {
        const int channels = rainy[k].channels();
        const double limit = 5.001 / 255 * channels;
        const float *r = rainy[k].data(), *d = derained[k].data(), *c = clean[k].data();
        for (const float* end = r + rainy[k].size(); r != end; r += channels, d += channels, c += channels) {
            double found = 0, truth = 0;
            for (int i = 0; i < channels; ++i) {
                found += double(r[i]) - d[i];
                truth += double(r[i]) - c[i];
            }
            result.add(found > limit, truth > limit);
        }
    }
    return result;
}

/// Wet pixels: alpha above 0.05.
inline Detection wetDetection(const std::vector<ImageF>& alphas, const std::vector<ImageF>& truth)
{
    assert(alphas.size() == truth.size());
    Detection result;
    for (std::size_t k = 0; k < alphas.size(); ++k)
        for (std::size_t i = 0; i < alphas[k].size(); ++i)
            result.add(alphas[k].data()[i] > 0.05f, truth[k].data()[i] > 0.05f);
    return result;
}

}  // namespace virga::test
