#include "matte/RainColor.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double wetLimit = 6.0;      // [sigma of the channels' mean] for the sample between a pair
constexpr double strongLimit = 12.0;  // for a sample whose colour is asked
constexpr double dryLimit = 2.0;      // of the channels' mean, for a sample that says what is behind
constexpr int fewestStrong = 200;
constexpr int firstLag = 2, lags = 2;  // steps along the rain from one of a pair to the other
constexpr int selections = 3;          // of the pairs, each with the C that the last one gave
constexpr double leastContrast = 0.1;  // of the typical |C - S|, where the limit for wet samples ends to fall
constexpr int rounds = 3;              // of weighing the channels by how sure they are

using Channels = std::array<double, 3>;

/// The scene as the dry samples of all other frames have it. A scene that knows a frame's own rain is a little brighter
/// where that is, which looks like rain that does less over bright ground, and so like a brighter C.
class Residual {
public:
    Residual(const Footage& footage, const ImageF& scene, double sigma)
        : width(scene.width()), height(scene.height()), channels(scene.channels()), footage_(footage), scene_(scene),
          sums_(width, height, channels), counts_(width, height, 1), limit_(float(dryLimit * sigma))
    {
        parallelFor(0, height, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            const std::size_t begin = std::size_t(first) * std::size_t(width);
            for (std::size_t k = 0; k < footage.frames.size(); ++k)
                for (std::size_t i = begin; i < std::size_t(last) * std::size_t(width); ++i) {
                    if (!isDry(k, i)) continue;
                    for (int j = 0; j < channels; ++j) sums_.data()[n(i, j)] += footage.frames[k].data()[n(i, j)];
                    counts_.data()[i] += 1.0f;
                }
        });
    }

    const int width, height, channels;

    /// Of so many frames is the scene here the mean.
    double samples(std::size_t k, std::size_t i) const { return counts_.data()[i] - (isDry(k, i) ? 1.0f : 0.0f); }
    double surface(std::size_t k, std::size_t i, int j) const
    {
        const bool isIn = isDry(k, i);
        const double count = counts_.data()[i] - (isIn ? 1.0f : 0.0f);
        if (count < 1.0) return scene_.data()[n(i, j)];
        return (double(sums_.data()[n(i, j)]) - (isIn ? double(footage_.frames[k].data()[n(i, j)]) : 0.0)) / count;
    }
    double at(std::size_t k, std::size_t i, int j) const
    {
        return double(footage_.frames[k].data()[n(i, j)]) - surface(k, i, j);
    }
    /// Of the channels; against the scene as it was solved.
    double mean(std::size_t k, std::size_t i) const
    {
        double sum = 0.0;
        for (int j = 0; j < channels; ++j) sum += double(footage_.frames[k].data()[n(i, j)]) - scene_.data()[n(i, j)];
        return sum / channels;
    }
    bool isTrusted(std::size_t k, std::size_t i) const { return footage_.trusted(k, i) > 0.5; }
    std::size_t frames() const { return footage_.frames.size(); }

private:
    std::size_t n(std::size_t i, int j) const { return i * std::size_t(channels) + std::size_t(j); }
    bool isDry(std::size_t k, std::size_t i) const { return isTrusted(k, i) && std::abs(mean(k, i)) <= limit_; }

    const Footage& footage_;
    const ImageF& scene_;
    ImageF sums_, counts_;
    float limit_;
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
            const double mean = residual.mean(k, i);
            if (std::abs(mean) <= limit || !residual.isTrusted(k, i)) continue;
            double surfaceMean = 0.0;
            for (int j = 0; j < residual.channels; ++j) surfaceMean += residual.surface(k, i, j) / residual.channels;
            for (int j = 0; j < residual.channels; ++j) {
                const double r = residual.at(k, i, j);
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
ImageF wetLimits(const ImageF& scene, double wet, double color)
{
    const auto channels = std::size_t(scene.channels());
    ImageF limits(scene.width(), scene.height(), 1);
    double typical = 0.0;
    for (std::size_t i = 0; i < limits.size(); ++i) {
        double mean = 0.0;
        for (std::size_t j = 0; j < channels; ++j) mean += scene.data()[i * channels + j] / double(channels);
        limits.data()[i] = float(std::abs(color - mean));
        typical += std::abs(color - mean) / double(limits.size());
    }
    const double least = leastContrast * typical;
    for (float& limit : limits.values()) limit = float(wet * std::max(double(limit), least) / std::max(typical, 1e-30));
    return limits;
}

/// Of the pairs of pixels `lag` steps apart along the rain that lie within a stroke: wet between and a step beyond
/// either. What decides is not the pair itself, whose noise would then have a say in which pairs there are.
void addPairs(const Residual& residual, const ImageF& limits, std::size_t k, double slant, int lag, double variance,
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
    Image<char> wet(width, height, 1);
    for (std::size_t i = 0; i < wet.size(); ++i)
        wet.data()[i] = std::abs(residual.mean(k, i)) > limits.data()[i] && residual.isTrusted(k, i);
    for (int x = left; x < right; ++x) {
        Moments sums;
        for (int y = top; y < bottom; ++y) {
            if (!std::all_of(around.begin(), around.end(), [&](const auto& d) { return wet.at(x + d[0], y + d[1]); }))
                continue;
            const std::size_t p = index(x, y), q = index(x + ox, y + oy);
            if (!residual.isTrusted(k, p) || !residual.isTrusted(k, q)) continue;
            // What the scene's own noise, of variance v, adds to the two products.
            const double v =
                variance * 0.5 *
                (1.0 / std::max(residual.samples(k, p), 1.0) + 1.0 / std::max(residual.samples(k, q), 1.0));
            for (std::size_t j = 0; j < std::size_t(residual.channels); ++j) {
                const double rp = residual.at(k, p, int(j)), rq = residual.at(k, q, int(j));
                const double sp = residual.surface(k, p, int(j)), sq = residual.surface(k, q, int(j));
                sums.numerator[j] += (rp * sq - rq * sp) * (sp - sq) + v * (sp + sq + rp + rq);
                sums.denominator[j] += (rp - rq) * (sp - sq) + 2.0 * v;
            }
        }
        to.push_back(sums);
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

RainColor rainColor(const Footage& footage, const ImageF& scene, double slant, double sigma, double guess)
{
    RainColor result;
    const double meanSigma = std::max(sigma, 1e-6) / std::sqrt(double(scene.channels()));
    const Residual residual(footage, scene, meanSigma);
    const ChannelLinks links = linkChannels(residual, strongLimit * meanSigma);
    if (links.samples < fewestStrong) return result;

    double mean = guess, error = 0.0;
    for (int selection = 0; selection < selections; ++selection) {
        const ImageF limits = wetLimits(scene, wetLimit * meanSigma, mean);
        std::vector<std::vector<Moments>> columns(residual.frames());
        parallelFor(0, std::ptrdiff_t(columns.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (auto k = std::size_t(first); k < std::size_t(last); ++k)
                for (int lag = firstLag; lag < firstLag + lags; ++lag)
                    addPairs(residual, limits, k, slant, lag, sigma * sigma, columns[k]);
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
