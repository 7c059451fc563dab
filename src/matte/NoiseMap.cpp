#include "matte/NoiseMap.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr std::size_t fewestSamples = 64;
constexpr double leastShare = 0.25;                   // of the typical block's
constexpr std::size_t frameStep = 2, columnStep = 2;  // samples enough

/// 1.4826 times the middle of depths below the scene: the standard deviation of noise that is as strong on both sides.
float deviationOf(std::vector<float>& depths)
{
    const auto middle = depths.begin() + std::ptrdiff_t(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    return 1.4826f * *middle;
}

}  // namespace

NoiseMap noiseMap(std::span<const ImageF> frames, std::span<const ImageF> trust, const ImageF& scene, double least)
{
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    const int columns = (width + NoiseMap::block - 1) / NoiseMap::block;
    const int rows = (height + NoiseMap::block - 1) / NoiseMap::block;
    NoiseMap map;
    map.sigma = ImageF(columns, rows, 1);
    // The scene was made of these frames and lies nearer to them than the truth does.
    const float bessel = frames.size() > 1 ? std::sqrt(float(frames.size()) / float(frames.size() - 1)) : 1.0f;
    parallelFor(0, rows, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<float> depths;
        for (int row = int(first); row < int(last); ++row)
            for (int b = 0; b < columns; ++b) {
                depths.clear();
                for (std::size_t k = 0; k<frames.size(); k += frames.size()> 4 ? frameStep : 1)
                    for (int y = row * NoiseMap::block; y < std::min(height, (row + 1) * NoiseMap::block); ++y)
                        for (int x = b * NoiseMap::block + y % columnStep;
                             x < std::min(width, (b + 1) * NoiseMap::block); x += columnStep) {
                            if (!trust.empty() && trust[k].at(x, y) < 0.5f) continue;
                            for (int j = 0; j < channels; ++j)
                                if (const float depth = scene.at(x, y, j) - frames[k].at(x, y, j); depth > 0.0f)
                                    depths.push_back(depth);
                        }
                map.sigma.at(b, row) = depths.size() >= fewestSamples ? bessel * deviationOf(depths) : 0.0f;
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
