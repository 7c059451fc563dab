#include "matte/StrokeHue.h"

#include <cmath>
#include <span>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double leastSharp = 0.7;  // second difference of the hue beside that of the light: less is smoothed
constexpr int fewestSamples = 100;
constexpr double leastError = 5e-4;  // of C: the channels' links, and values stored in steps, are known no better

/// Of the samples in one column of one frame.
struct Column {
    double numerator = 0, denominator = 0;
    int samples = 0;
    // Of the hue on the light: products and squares, of the values and of their second differences across.
    double wide = 0, wideSquare = 0, fine = 0, fineSquare = 0;

    void add(const Column& other)
    {
        numerator += other.numerator;
        denominator += other.denominator;
        samples += other.samples;
        wide += other.wide;
        wideSquare += other.wideSquare;
        fine += other.fine;
        fineSquare += other.fineSquare;
    }
};

/// The samples of one frame.
class Frame {
public:
    Frame(const StrokeResidual& residual, const ChannelLinks& links, std::size_t frame, double variance)
        : residual_(residual), links_(links), frame_(frame), channels_(std::size_t(residual.channels)),
          variance_(variance)
    {
    }

    void add(int x, int y, Column& to) const
    {
        const Sample here = at(x, y), left = at(x - 1, y), right = at(x + 1, y);
        const double n = double(channels_), v = variance_ / std::max(residual_.samples(frame_, index(x, y)), 1.0);
        std::array<double, 3> hue{};
        double hueSquare = 0, wide = 0, fine = 0;
        for (std::size_t j = 0; j < channels_; ++j) {
            const double slope = links_.slope[j], offset = links_.offset[j];
            hue[j] = offset - here.surface[j] + slope * here.surfaceMean;
            // Noise of S: what it adds to the products, in the mean.
            const double light = here.surfaceMean + here.mean, own = here.off[j] + here.surface[j] - offset;
            const double product = v * (light * (1.0 - slope / n) - own * (1.0 - slope) / n);
            const double square = v * (1.0 - 2.0 * slope / n + slope * slope / n);
            to.numerator +=
                hue[j] * (here.off[j] * here.surfaceMean - here.mean * (here.surface[j] - offset)) - product;
            to.denominator += hue[j] * tint(here, j) - square;
            hueSquare += hue[j] * hue[j];
            wide += hue[j] * tint(here, j);
            fine += hue[j] * (tint(here, j) - 0.5 * (tint(left, j) + tint(right, j)));
        }
        ++to.samples;
        const double second = here.mean - 0.5 * (left.mean + right.mean), noise = variance_ / n;
        to.wide += wide * here.mean;
        to.wideSquare += hueSquare * (here.mean * here.mean - noise);
        to.fine += fine * second;
        to.fineSquare += hueSquare * (second * second - 1.5 * noise);
    }

private:
    struct Sample {
        std::array<double, 3> off{}, surface{};
        double mean = 0, surfaceMean = 0;
    };

    std::size_t index(int x, int y) const { return std::size_t(y) * std::size_t(residual_.width) + std::size_t(x); }
    Sample at(int x, int y) const
    {
        Sample sample;
        for (std::size_t j = 0; j < channels_; ++j) {
            sample.off[j] = residual_.off(frame_, index(x, y), int(j));
            sample.surface[j] = residual_.surface(frame_, index(x, y), int(j));
            sample.mean += sample.off[j] / double(channels_);
            sample.surfaceMean += sample.surface[j] / double(channels_);
        }
        return sample;
    }
    /// What the stroke has of the scene's hue: alpha times that.
    double tint(const Sample& sample, std::size_t j) const { return sample.off[j] - links_.slope[j] * sample.mean; }

    const StrokeResidual& residual_;
    const ChannelLinks& links_;
    std::size_t frame_, channels_;
    double variance_;
};

}  // namespace

ColorEvidence colorFromHue(const StrokeResidual& residual, const ChannelLinks& links, const ImageF& wet, double slant,
                           double sigma)
{
    if (residual.channels < 3 || residual.width < 3) return {};
    const double s = std::sin(slant), c = std::cos(slant), steepest = std::max(std::abs(s), std::abs(c));
    const int dx = int(std::lround(s / steepest)), dy = int(std::lround(c / steepest));
    const auto width = std::size_t(residual.width);
    std::vector<Column> columns(residual.frames() * width);
    parallelFor(0, std::ptrdiff_t(residual.frames()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            const Image<char> isWet = residual.wet(k, wet);
            const Frame frame(residual, links, k, sigma * sigma);
            for (int y = std::abs(dy); y + std::abs(dy) < residual.height; ++y)
                for (int x = 1; x + 1 < residual.width; ++x) {
                    if (!isWet.at(x - dx, y - dy, 0) || !isWet.at(x + dx, y + dy, 0)) continue;
                    if (!residual.isTrusted(k, std::size_t(y) * width + std::size_t(x))) continue;
                    frame.add(x, y, columns[k * width + std::size_t(x)]);
                }
        }
    });
    Column all;
    for (const Column& column : columns) all.add(column);
    const bool isSharp = all.fine * all.wideSquare > leastSharp * all.wide * all.fineSquare;
    if (all.samples < fewestSamples || !(all.denominator > 0.0) || !isSharp) return {};
    const double mean = all.numerator / all.denominator;
    double variance = 0;
    for (const Column& column : columns) variance += std::pow(column.numerator - mean * column.denominator, 2);
    const double error = std::hypot(std::sqrt(variance) / all.denominator, leastError * mean);
    return {mean, error, std::isfinite(mean) && std::isfinite(error)};
}

}  // namespace virga::matte
