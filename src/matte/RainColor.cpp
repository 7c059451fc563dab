#include "matte/RainColor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/PixelRows.h"

namespace virga::matte {
namespace {

constexpr double wetLimit = 6.0;      // [sigma of the channels' mean] for the sample between a pair
constexpr double strongLimit = 12.0;  // for a sample whose colour is asked
constexpr double dryLimit = 2.0;      // of the channels' mean, for a sample that says what is behind
constexpr int fewestStrong = 200;
constexpr float leastTrust = 0.5f;
constexpr std::size_t enoughPixels = 2'500'000, fewestFrames = 6;  // that pairs are looked for in
constexpr int firstLag = 2, lags = 2;  // steps along the rain from one of a pair to the other
constexpr double lamp = 4.0;           // times the guess of C
constexpr std::size_t contrastStride = 3;
constexpr double leastContrast = 0.1;  // of the typical |C - S|, where the limit for wet samples ends to fall
constexpr int rounds = 3;              // of weighing the channels by how sure they are

using Channels = std::array<double, 3>;

/// Adds the values that are dry, `mask` 1 or 0.
VIRGA_SIMD void addMasked(const float* __restrict values, const float* __restrict mask, int count, float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] += mask[i] * values[i];
}

VIRGA_SIMD void markDry(const float* __restrict mean, const float* __restrict trusted, float limit, int count,
                        float* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = (std::abs(mean[i]) <= limit) & (trusted[i] > leastTrust) ? 1.0f : 0.0f;
}

VIRGA_SIMD void markWet(const float* __restrict mean, const float* __restrict trusted, const float* __restrict limits,
                        int count, char* __restrict to)
{
    for (int i = 0; i < count; ++i) to[i] = char((std::abs(mean[i]) > limits[i]) & (trusted[i] > leastTrust));
}

/// The scene as the dry samples of all other frames have it. A scene that knows a frame's own rain is a little brighter
/// where that is, which looks like rain that does less over bright ground, and so like a brighter C. Its frames, from 0
/// on, are some of the footage's, evenly spread.
class Residual {
public:
    Residual(const Footage& footage, const ImageF& scene, double sigma, double brightest)
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

    const int width, height, channels;

    /// Of so many frames is the scene here the mean.
    double samples(std::size_t n, std::size_t i) const { return counts_.data()[i] - (isDry(n, i) ? 1.0f : 0.0f); }
    double surface(std::size_t n, std::size_t i, int j) const
    {
        const bool isIn = isDry(n, i);
        const double count = counts_.data()[i] - (isIn ? 1.0f : 0.0f);
        if (count < 1.0) return scene_.data()[at(i, j)];
        return (double(sums_.data()[at(i, j)]) - (isIn ? value(n, i, j) : 0.0)) / count;
    }
    double off(std::size_t n, std::size_t i, int j) const { return value(n, i, j) - surface(n, i, j); }
    /// Of the channels; against the scene as it was solved.
    const ImageF& mean(std::size_t n) const { return means_[n]; }
    /// Where it is trusted and beyond `limits`.
    Image<char> wet(std::size_t n, const ImageF& limits) const
    {
        Image<char> wet(width, height, 1);
        const std::vector<float> ones(std::size_t(width), 1.0f);
        for (int y = 0; y < height; ++y)
            markWet(means_[n].row(y), footage_.trust.empty() ? ones.data() : footage_.trust[which_[n]].row(y),
                    limits.row(y), width, wet.row(y));
        return wet;
    }
    /// Not so a lamp: between it and what is beside it the scene is so steep that nothing else would have a say.
    bool isTrusted(std::size_t n, std::size_t i) const
    {
        return footage_.trusted(which_[n], i) > leastTrust && scene_.data()[at(i, 0)] <= brightest_;
    }
    std::size_t frames() const { return which_.size(); }

private:
    std::size_t at(std::size_t i, int j) const { return i * std::size_t(channels) + std::size_t(j); }
    double value(std::size_t n, std::size_t i, int j) const
    {
        return double(footage_.frames[which_[n]].data()[at(i, j)]);
    }
    bool isDry(std::size_t n, std::size_t i) const
    {
        return isTrusted(n, i) && std::abs(means_[n].data()[i]) <= limit_;
    }

    const Footage& footage_;
    const ImageF& scene_;
    ImageF sums_, counts_;
    std::vector<std::size_t> which_;
    std::vector<ImageF> means_;
    float limit_, brightest_;
};

/// C = offset + slope * (mean of C), channel by channel.
struct ChannelLinks {
    Channels offset{}, slope{};
    int samples = 0;
};

ChannelLinks linkChannels(const Residual& residual, double limit)
{
    ChannelLinks links;
    double meanSum = 0.0;
    for (std::size_t k = 0; k < residual.frames(); ++k)
        for (std::size_t i = 0; i < std::size_t(residual.width) * std::size_t(residual.height); ++i) {
            const double mean = residual.mean(k).data()[i];
            if (std::abs(mean) <= limit || !residual.isTrusted(k, i)) continue;
            double surfaceMean = 0.0;
            for (int j = 0; j < residual.channels; ++j) surfaceMean += residual.surface(k, i, j) / residual.channels;
            for (int j = 0; j < residual.channels; ++j) {
                const double r = residual.off(k, i, j);
                links.slope[std::size_t(j)] += r;
                links.offset[std::size_t(j)] += mean * residual.surface(k, i, j) - r * surfaceMean;
            }
            meanSum += mean;
            ++links.samples;
        }
    for (int j = 0; j < residual.channels; ++j) {
        links.slope[std::size_t(j)] /= meanSum;
        links.offset[std::size_t(j)] /= meanSum;
    }
    return links;
}

/// Of the pairs in one column of one frame, channel by channel, what is summed up: the sum of what vanishes is
/// numerator - C denominator.
struct Moments {
    Channels numerator{}, denominator{};
};

/// How far the channels' mean has to be from the scene for a sample to be wet. In units of alpha it is the same
/// everywhere: a limit in units of light would ask for more alpha over bright ground, and alpha would then seem to grow
/// with the scene.
/// ground  the mean of the scene's channels
ImageF wetLimits(const ImageF& ground, double wet, double color)
{
    ImageF limits(ground.width(), ground.height(), 1);
    std::vector<float> contrasts;  // their median: a lamp is brighter than everything else together
    for (std::size_t i = 0; i < ground.size(); i += contrastStride)
        contrasts.push_back(std::abs(float(color) - ground.data()[i]));
    const auto middle = contrasts.begin() + std::ptrdiff_t(contrasts.size() / 2);
    std::nth_element(contrasts.begin(), middle, contrasts.end());
    const double typical = *middle;
    const auto least = float(leastContrast * typical), scale = float(wet / std::max(typical, 1e-30));
    for (std::size_t i = 0; i < limits.size(); ++i)
        limits.data()[i] = scale * std::max(std::abs(float(color) - ground.data()[i]), least);
    return limits;
}

VIRGA_SIMD void keepBoth(const char* __restrict other, int count, char* __restrict marks)
{
    for (int i = 0; i < count; ++i) marks[i] &= other[i];
}

/// Of the pairs of pixels `lag` steps apart along the rain that lie within a stroke: wet between and a step beyond
/// either. What decides is not the pair itself, whose noise would then have a say in which pairs there are.
void addPairs(const Residual& residual, const Image<char>& wet, std::size_t k, double slant, int lag, double variance,
              std::vector<Moments>& to)
{
    // A pixel further along the steeper axis with each step, so that no two of them are the same.
    const double s = std::sin(slant), c = std::cos(slant), steepest = std::max(std::abs(s), std::abs(c));
    const auto step = [&](int t) {
        return std::array{int(std::lround(t * s / steepest)), int(std::lround(t * c / steepest))};
    };
    std::vector<std::array<int, 2>> around;
    for (int t = -1; t <= lag + 1; ++t)
        if (t != 0 && t != lag) around.push_back(step(t));
    const auto [ox, oy] = step(lag);
    const auto [bx, by] = step(-1);
    const auto [ax, ay] = step(lag + 1);
    const int width = residual.width, height = residual.height;
    const int left = std::max({0, -bx, -ax}), right = width + std::min({0, -bx, -ax});
    const int top = std::max({0, -by, -ay}), bottom = height + std::min({0, -by, -ay});
    const auto index = [&](int x, int y) { return std::size_t(y) * std::size_t(width) + std::size_t(x); };
    const std::size_t begin = to.size();
    to.resize(begin + std::size_t(width));
    std::vector<char> within(std::size_t(std::max(right - left, 0)));
    for (int y = top; y < bottom && left < right; ++y) {
        std::fill(within.begin(), within.end(), char(1));
        for (const auto& [dx, dy] : around) keepBoth(wet.row(y + dy) + left + dx, right - left, within.data());
        for (int x = left; x < right; ++x) {
            if (!within[std::size_t(x - left)]) continue;
            const std::size_t p = index(x, y), q = index(x + ox, y + oy);
            if (!residual.isTrusted(k, p) || !residual.isTrusted(k, q)) continue;
            // What the scene's own noise, of variance v, adds to the two products.
            const double v =
                variance * 0.5 *
                (1.0 / std::max(residual.samples(k, p), 1.0) + 1.0 / std::max(residual.samples(k, q), 1.0));
            Moments& sums = to[begin + std::size_t(x)];
            for (std::size_t j = 0; j < std::size_t(residual.channels); ++j) {
                const double rp = residual.off(k, p, int(j)), rq = residual.off(k, q, int(j));
                const double sp = residual.surface(k, p, int(j)), sq = residual.surface(k, q, int(j));
                sums.numerator[j] += (rp * sq - rq * sp) * (sp - sq) + v * (sp + sq + rp + rq);
                sums.denominator[j] += (rp - rq) * (sp - sq) + 2.0 * v;
            }
        }
    }
}

/// The mean of C's channels from the columns' moments, and its standard error; columns are independent, what is within
/// one is not, and the lags look at the same rain.
bool colorFrom(std::span<const Moments> columns, const ChannelLinks& links, int channels, double& mean, double& error)
{
    Moments all;
    for (const Moments& column : columns)
        for (std::size_t j = 0; j < std::size_t(channels); ++j) {
            all.numerator[j] += column.numerator[j];
            all.denominator[j] += column.denominator[j];
        }
    for (int round = 0; round < rounds; ++round) {
        double sum = 0.0, weights = 0.0;
        for (std::size_t j = 0; j < std::size_t(channels); ++j) {
            const double color = links.offset[j] + links.slope[j] * mean;
            double variance = 0.0;
            for (const Moments& column : columns) {
                const double off = column.numerator[j] - color * column.denominator[j];
                variance += lags * off * off;
            }
            if (!(variance > 0.0)) continue;
            const double lever = links.slope[j] * all.denominator[j];
            sum += lever * (all.numerator[j] - links.offset[j] * all.denominator[j]) / variance;
            weights += lever * lever / variance;
        }
        if (!(weights > 0.0)) return false;
        mean = sum / weights;
        error = 1.0 / std::sqrt(weights);
    }
    return std::isfinite(mean) && std::isfinite(error);
}

}  // namespace

RainColor rainColor(const Footage& footage, const ImageF& scene, double slant, double sigma, double guess,
                    int selections)
{
    RainColor result;
    const double meanSigma = std::max(sigma, std::numeric_limits<double>::min()) / std::sqrt(double(scene.channels()));
    const Residual residual(footage, scene, meanSigma, lamp * std::abs(guess));
    const ChannelLinks links = linkChannels(residual, strongLimit * meanSigma);
    if (links.samples < fewestStrong) return result;

    ImageF ground(scene.width(), scene.height(), 1);
    meanDifference(scene.data(), ImageF(scene.width(), scene.height(), scene.channels()).data(), scene.channels(),
                   ground.size(), ground.data());
    double mean = guess, error = 0.0;
    for (int selection = 0; selection < selections; ++selection) {
        const ImageF limits = wetLimits(ground, wetLimit * meanSigma, mean);
        std::vector<std::vector<Moments>> columns(residual.frames());
        parallelFor(0, std::ptrdiff_t(columns.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
                const Image<char> wet = residual.wet(k, limits);
                for (int lag = firstLag; lag < firstLag + lags; ++lag)
                    addPairs(residual, wet, k, slant, lag, sigma * sigma, columns[k]);
            }
        });
        std::vector<Moments> all;
        for (const auto& some : columns) all.insert(all.end(), some.begin(), some.end());
        if (!colorFrom(all, links, residual.channels, mean, error)) return result;
    }
    Channels color{};
    for (std::size_t j = 0; j < color.size(); ++j) color[j] = links.offset[j] + links.slope[j] * mean;
    if (residual.channels == 1) color[1] = color[2] = color[0];
    for (std::size_t j = 0; j < color.size(); ++j) result.color[j] = float(color[j]);
    result.error = error;
    result.found = true;
    return result;
}

}  // namespace virga::matte
