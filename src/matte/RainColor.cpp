#include "matte/RainColor.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double wetLimit = 6.0;      // [sigma of the channels' mean] for the sample between a pair
constexpr double strongLimit = 12.0;  // for a sample whose colour is asked
constexpr double dryLimit = 2.0;      // of the channels' mean, for a sample that says what is behind
constexpr int fewestStrong = 200;
constexpr int lags = 2;
constexpr int rounds = 3;  // of weighing the channels by how sure they are

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

/// body(frame, p, q) for the pairs of pixels `lag` apart along the rain between which it is wet; `column` is called
/// before each column of a frame, whose pairs hang together.
template <class Column, class Body>
void forWetPairs(const Residual& residual, double slant, int lag, double limit, Column&& column, Body&& body)
{
    const auto step = [&](double length) {
        return std::array{int(std::lround(length * std::sin(slant))), int(std::lround(length * std::cos(slant)))};
    };
    const auto [ox, oy] = step(lag);
    const auto [hx, hy] = step(0.5 * lag);
    const auto index = [&](int x, int y) { return std::size_t(y) * std::size_t(residual.width) + std::size_t(x); };
    for (std::size_t k = 0; k < residual.frames(); ++k)
        for (int x = std::max(0, -ox); x < residual.width - std::max(0, ox); ++x) {
            column();
            for (int y = 0; y + oy < residual.height; ++y) {
                const std::size_t p = index(x, y), q = index(x + ox, y + oy), between = index(x + hx, y + hy);
                if (std::abs(residual.mean(k, between)) <= limit) continue;
                if (residual.isTrusted(k, p) && residual.isTrusted(k, q)) body(k, p, q);
            }
        }
}

}  // namespace

RainColor rainColor(const Footage& footage, const ImageF& scene, double slant, double sigma)
{
    RainColor result;
    const double meanSigma = std::max(sigma, 1e-6) / std::sqrt(double(scene.channels()));
    const Residual residual(footage, scene, meanSigma);
    const ChannelLinks links = linkChannels(residual, strongLimit * meanSigma);
    if (links.samples < fewestStrong) return result;

    // Each channel's sum is numerator - C * denominator.
    const double wet = wetLimit * meanSigma;
    Channels numerator{}, denominator{};
    for (int lag = 1; lag <= lags; ++lag)
        forWetPairs(
            residual, slant, lag, wet, [] {},
            [&](std::size_t k, std::size_t p, std::size_t q) {
                for (int j = 0; j < residual.channels; ++j) {
                    const double rp = residual.at(k, p, j), rq = residual.at(k, q, j);
                    const double sp = residual.surface(k, p, j), sq = residual.surface(k, q, j);
                    // What the scene's own noise, of variance v, adds to the two products.
                    const double v =
                        sigma * sigma * 0.5 *
                        (1.0 / std::max(residual.samples(k, p), 1.0) + 1.0 / std::max(residual.samples(k, q), 1.0));
                    numerator[std::size_t(j)] += (rp * sq - rq * sp) * (sp - sq) + v * (sp + sq + rp + rq);
                    denominator[std::size_t(j)] += (rp - rq) * (sp - sq) + 2.0 * v;
                }
            });

    Channels color{};
    for (int j = 0; j < residual.channels; ++j)
        color[std::size_t(j)] = links.offset[std::size_t(j)] + links.slope[std::size_t(j)];
    double weights = 0.0;
    for (int round = 0; round < rounds; ++round) {
        // Columns are independent, what is within one is not; the lags look at the same rain.
        Channels variance{}, sum{};
        const auto close = [&] {
            for (std::size_t j = 0; j < sum.size(); ++j) variance[j] += lags * sum[j] * sum[j];
            sum = {};
        };
        for (int lag = 1; lag <= lags; ++lag) {
            forWetPairs(residual, slant, lag, wet, close, [&](std::size_t k, std::size_t p, std::size_t q) {
                for (int j = 0; j < residual.channels; ++j) {
                    const double sp = residual.surface(k, p, j), sq = residual.surface(k, q, j),
                                 c = color[std::size_t(j)];
                    sum[std::size_t(j)] +=
                        (residual.at(k, p, j) * (c - sq) - residual.at(k, q, j) * (c - sp)) * (sp - sq);
                }
            });
            close();
        }
        double mean = 0.0;
        weights = 0.0;
        for (int j = 0; j < residual.channels; ++j) {
            const auto c = std::size_t(j);
            if (!(variance[c] > 0.0)) continue;
            const double lever = links.slope[c] * denominator[c];
            mean += lever * (numerator[c] - links.offset[c] * denominator[c]) / variance[c];
            weights += lever * lever / variance[c];
        }
        if (!(weights > 0.0)) return result;
        mean /= weights;
        for (std::size_t j = 0; j < color.size(); ++j) color[j] = links.offset[j] + links.slope[j] * mean;
    }
    if (residual.channels == 1) color[1] = color[2] = color[0];
    for (std::size_t j = 0; j < color.size(); ++j) result.color[j] = float(color[j]);
    result.error = 1.0 / std::sqrt(weights);
    result.found = std::isfinite(result.error);
    return result;
}

}  // namespace virga::matte
