#include "matte/RainColor.h"

#include <algorithm>
#include <cmath>

namespace virga::matte {
namespace {

constexpr double wetLimit = 6.0;      // [sigma of the channels' mean] for the sample between a pair
constexpr double strongLimit = 12.0;  // for a sample whose colour is asked
constexpr int fewestStrong = 200;
constexpr int lags = 2;
constexpr int rounds = 3;  // of weighing the channels by how sure they are

using Channels = std::array<double, 3>;

/// I - S with what is needed to walk about in it.
struct Residual {
    const Footage& footage;
    const ImageF& scene;
    int width, height, channels;

    double at(std::size_t k, std::size_t i, int j) const
    {
        const std::size_t n = i * std::size_t(channels) + std::size_t(j);
        return double(footage.frames[k].data()[n]) - scene.data()[n];
    }
    double mean(std::size_t k, std::size_t i) const
    {
        double sum = 0.0;
        for (int j = 0; j < channels; ++j) sum += at(k, i, j);
        return sum / channels;
    }
    double surface(std::size_t i, int j) const { return scene.data()[i * std::size_t(channels) + std::size_t(j)]; }
    bool isTrusted(std::size_t k, std::size_t i) const { return footage.trusted(k, i) > 0.5; }
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
    for (std::size_t k = 0; k < residual.footage.frames.size(); ++k)
        for (std::size_t i = 0; i < std::size_t(residual.width) * std::size_t(residual.height); ++i) {
            const double mean = residual.mean(k, i);
            if (std::abs(mean) <= limit || !residual.isTrusted(k, i)) continue;
            double surfaceMean = 0.0;
            for (int j = 0; j < residual.channels; ++j) surfaceMean += residual.surface(i, j) / residual.channels;
            for (int j = 0; j < residual.channels; ++j) {
                const double r = residual.at(k, i, j);
                links.slope[std::size_t(j)] += r;
                links.offset[std::size_t(j)] += mean * residual.surface(i, j) - r * surfaceMean;
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
    for (std::size_t k = 0; k < residual.footage.frames.size(); ++k)
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
    const Residual residual{footage, scene, scene.width(), scene.height(), scene.channels()};
    const double meanSigma = std::max(sigma, 1e-6) / std::sqrt(double(residual.channels));
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
                    const double sp = residual.surface(p, j), sq = residual.surface(q, j);
                    numerator[std::size_t(j)] += (rp * sq - rq * sp) * (sp - sq);
                    denominator[std::size_t(j)] += (rp - rq) * (sp - sq);
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
                    const double sp = residual.surface(p, j), sq = residual.surface(q, j), c = color[std::size_t(j)];
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
