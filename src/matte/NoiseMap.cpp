#include "matte/NoiseMap.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr std::size_t fewestSamples = 64;
constexpr double fewestOwn = 2.0;    // frames: of fewer no spread is to be had
constexpr double leastShare = 0.25;  // of the typical block's
constexpr int columnStep = 2;
constexpr std::size_t manyFrames = 12;
constexpr double settled = 1e-7;  // of a deviation

/// The x beyond which a share 1 - p of |x| lies, x normal with deviation 1: Newton's method on erf, from its tail.
double halfNormalQuantile(double p)
{
    double x = std::clamp(p, 0.0, 0.999);
    for (int step = 0; step < 20; ++step) {
        const double density = std::sqrt(2.0 / std::numbers::pi) * std::exp(-0.5 * x * x);
        const double last = x;
        x = std::clamp(x - (std::erf(x / std::numbers::sqrt2) - p) / density, 0.0, 6.0);
        if (std::abs(x - last) <= settled * x) break;
    }
    return x;
}

/// Adds those of a row's depths below the scene that are more than `least`; the first free place in `to` after them,
/// which needs room for all.
template <int channels>
float* addDepths(const float* frame, const float* scene, const float* trust, int first, int last, float least,
                 float* to)
{
    for (int x = first; x < last; x += columnStep) {
        const bool isTrusted = trust == nullptr || !(trust[x] < 0.5f);
        for (int j = 0; j < channels; ++j) {
            const float depth = scene[x * channels + j] - frame[x * channels + j];
            *to = depth;
            to += (depth > least) & isTrusted;
        }
    }
    return to;
}

/// Columns left up to right, rows top up to bottom, which are no part of it.
struct Block {
    int left, top, right, bottom;
};

/// None of the block's values differs by more than `repeated`.
bool isRepeated(const ImageF& frame, const ImageF& before, const Block& block, double repeated)
{
    for (int y = block.top; y < block.bottom; ++y) {
        const float *now = frame.pixel(block.left, y), *was = before.pixel(block.left, y);
        for (int i = 0; i < (block.right - block.left) * frame.channels(); ++i)
            if (std::abs(now[i] - was[i]) > float(repeated)) return false;
    }
    return true;
}

/// How many frames of their own make a mean as noisy as that of all: a picture that is repeated n times has n^2 times
/// the say in its variance.
double ownFrames(std::span<const ImageF> frames, const Block& block, double repeated)
{
    double run = 0.0, squares = 0.0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        if (k == 0 || !isRepeated(frames[k], frames[k - 1], block, repeated)) run = 0.0;
        squares += 2.0 * run + 1.0;  // (run + 1)^2 - run^2
        run += 1.0;
    }
    return double(frames.size()) * double(frames.size()) / squares;
}

Block blockAt(int column, int row, const ImageF& image)
{
    return {column * NoiseMap::block, row * NoiseMap::block, std::min(image.width(), (column + 1) * NoiseMap::block),
            std::min(image.height(), (row + 1) * NoiseMap::block)};
}

ImageF roomFor(const ImageF& image)
{
    const auto blocks = [](int length) { return (length + NoiseMap::block - 1) / NoiseMap::block; };
    return ImageF(blocks(image.width()), blocks(image.height()), 1);
}

}  // namespace

ImageF ownFrames(std::span<const ImageF> frames, double repeated)
{
    ImageF own = roomFor(frames[0]);
    parallelFor(0, own.height(), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int row = int(first); row < int(last); ++row)
            for (int b = 0; b < own.width(); ++b)
                own.at(b, row) = float(ownFrames(frames, blockAt(b, row, frames[0]), repeated));
    });
    return own;
}

double darkDeviation(std::vector<float>& depths, double repeated)
{
    const auto seen = std::partition(depths.begin(), depths.end(), [&](float depth) { return depth <= repeated; });
    const auto count = std::size_t(depths.end() - seen);
    if (count < fewestSamples) return 0.0;
    const auto middle = seen + std::ptrdiff_t(count / 2);
    std::nth_element(seen, middle, depths.end());
    // The median of a normal whose values under `repeated` are missing is that of a higher quantile.
    double sigma = *middle / 0.6745;
    for (int step = 0; step < 8; ++step) {
        const double last = sigma, missing = std::erf(repeated / (sigma * std::numbers::sqrt2));
        sigma = *middle / halfNormalQuantile(0.5 * (1.0 + std::min(missing, 0.9)));
        if (std::abs(sigma - last) <= settled * sigma) break;
    }
    return sigma;
}

NoiseMap noiseMap(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene, double least,
                  double repeated, NoiseSamples samples, const ImageF* own)
{
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    NoiseMap map;
    map.sigma = roomFor(scene);
    const int columns = map.sigma.width(), rows = map.sigma.height();
    const std::size_t count = frames.size();
    const std::size_t step = count <= 4 ? 1 : samples == NoiseSamples::Few && count >= manyFrames ? 4 : 2;
    const auto add = channels == 3 ? &addDepths<3> : &addDepths<1>;
    parallelFor(0, rows, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<float> depths;
        const auto most = (count / step + 1) * NoiseMap::block * NoiseMap::block * std::size_t(channels);
        for (int row = int(first); row < int(last); ++row)
            for (int b = 0; b < columns; ++b) {
                depths.resize(most);
                float* end = depths.data();
                for (std::size_t k = 0; k < count; k += step)
                    for (int y = row * NoiseMap::block; y < std::min(height, (row + 1) * NoiseMap::block); ++y)
                        end = add(frames[k].row(y), scene.row(y), trust.empty() ? nullptr : trust[k].row(y),
                                  b * NoiseMap::block + y % columnStep, std::min(width, (b + 1) * NoiseMap::block),
                                  float(repeated), end);
                depths.resize(std::size_t(end - depths.data()));
                // The scene was made of these frames and lies nearer to them than the truth does.
                const double many = own ? double(own->at(b, row)) : ownFrames(frames, blockAt(b, row, scene), repeated);
                const double counted = std::max(many, fewestOwn);
                const double nearer = frames.size() > 1 ? std::sqrt(counted / (counted - 1.0)) : 1.0;
                map.sigma.at(b, row) = float(nearer * darkDeviation(depths, repeated));
            }
    });
    std::vector<float> known;
    for (const float sigma : map.sigma.values())
        if (sigma > 0.0f) known.push_back(sigma);
    if (!known.empty()) {
        const auto middle = known.begin() + std::ptrdiff_t(known.size() / 2);
        std::nth_element(known.begin(), middle, known.end());
        map.typical = *middle;
    }
    map.typical = std::max(map.typical, least);
    const float floor = float(std::max(leastShare * map.typical, least));
    for (float& sigma : map.sigma.values()) sigma = sigma > 0.0f ? std::max(sigma, floor) : float(map.typical);
    return map;
}

}  // namespace virga::matte
