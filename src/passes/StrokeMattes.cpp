#include "passes/StrokeMattes.h"

namespace virga::passes {

std::vector<float> normalisedPrefix(const matte::StrokeAtlas& atlas)
{
    std::vector<float> prefix = atlas.alongPrefix;
    const std::size_t row = std::size_t(atlas.height) + 1;
    for (std::size_t first = 0; first < prefix.size(); first += row) {
        const float total = prefix[first + row - 1];
        for (std::size_t k = 0; k < row; ++k) prefix[first + k] /= total;
    }
    return prefix;
}

std::vector<float> rowDensities(const matte::StrokeAtlas& atlas)
{
    std::vector<float> densities(atlas.layers.values().begin(), atlas.layers.values().end());
    for (std::size_t first = 0; first < densities.size(); first += std::size_t(atlas.width)) {
        float sum = 0;
        for (int u = 0; u < atlas.width; ++u) sum += densities[first + std::size_t(u)];
        for (int u = 0; u < atlas.width; ++u)
            densities[first + std::size_t(u)] =
                sum > 0 ? densities[first + std::size_t(u)] * float(atlas.width) / sum : 1;
    }
    return densities;
}

}  // namespace virga::passes
