#include "matte/RainColor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/PixelRows.h"
#include "matte/StrokeHue.h"
#include "matte/StrokeResidual.h"

namespace virga::matte {
namespace {

constexpr double wetLimit = 6.0;      // [sigma of the channels' mean] for the sample between a pair
constexpr double strongLimit = 12.0;  // for a sample whose colour is asked
constexpr int fewestStrong = 200;
constexpr int firstLag = 2, lags = 2;  // steps along the rain from one of a pair to the other
constexpr double lamp = 4.0;           // times the guess of C
constexpr std::size_t contrastStride = 3;
constexpr double leastContrast = 0.1;  // of the typical |C - S|, where the limit for wet samples ends to fall
constexpr double contradiction = 3.0;  // standard errors between two kinds of evidence
constexpr int rounds = 3;              // of weighing the channels by how sure they are

using Channels = std::array<double, 3>;

ChannelLinks linkChannels(const StrokeResidual& residual, double limit)
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
void addPairs(const StrokeResidual& residual, const Image<char>& wet, std::size_t k, double slant, int lag,
              double variance, std::vector<Moments>& to)
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

/// From the columns' moments; columns are independent, what is within one is not, and the lags look at the same rain.
ColorEvidence colorFromPairs(std::span<const Moments> columns, const ChannelLinks& links, int channels, double mean)
{
    Moments all;
    for (const Moments& column : columns)
        for (std::size_t j = 0; j < std::size_t(channels); ++j) {
            all.numerator[j] += column.numerator[j];
            all.denominator[j] += column.denominator[j];
        }
    double error = 0.0;
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
        if (!(weights > 0.0)) return {};
        mean = sum / weights;
        error = 1.0 / std::sqrt(weights);
    }
    return {mean, error, std::isfinite(mean) && std::isfinite(error)};
}

/// Both, weighted by how sure they are, unless they contradict each other: then the footage's hues are not its own.
ColorEvidence together(const ColorEvidence& pairs, const ColorEvidence& hue)
{
    if (!pairs.found || !hue.found) return pairs.found ? pairs : hue;
    if (std::abs(pairs.mean - hue.mean) > contradiction * std::hypot(pairs.error, hue.error)) return pairs;
    if (!(hue.error > 0.0)) return hue;
    const double a = 1.0 / (pairs.error * pairs.error), b = 1.0 / (hue.error * hue.error);
    return {(a * pairs.mean + b * hue.mean) / (a + b), 1.0 / std::sqrt(a + b), true};
}

}  // namespace

RainColor rainColor(const Footage& footage, const ImageF& scene, double slant, double sigma, double guess,
                    int selections)
{
    RainColor result;
    const double meanSigma = std::max(sigma, std::numeric_limits<double>::min()) / std::sqrt(double(scene.channels()));
    const StrokeResidual residual(footage, scene, meanSigma, lamp * std::abs(guess));
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
        const ColorEvidence found = together(colorFromPairs(all, links, residual.channels, mean),
                                             colorFromHue(residual, links, limits, slant, sigma));
        if (!found.found) return result;
        mean = found.mean;
        error = found.error;
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
