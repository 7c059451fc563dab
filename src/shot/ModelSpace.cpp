#include "shot/ModelSpace.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/Parallel.h"
#include "io/Curve.h"
#include "matte/TemporalMedian.h"

namespace virga::shot {
namespace {

constexpr std::size_t steps = 8;
constexpr std::size_t fewestSamples = 200;
constexpr float rounding = 1e-6f;  // of a value: what the mean of equal values may be off by

}  // namespace

std::optional<ModelSpace> modelSpaceNamed(const std::string& name)
{
    if (name == "linear") return ModelSpace::Linear;
    if (name == "display") return ModelSpace::Display;
    return std::nullopt;
}

const char* nameOf(ModelSpace space) { return space == ModelSpace::Linear ? "linear" : "display"; }

void toModel(ImageF& linear, ModelSpace space)
{
    if (space == ModelSpace::Display) io::encodeCurve(io::Curve::Srgb, linear.data(), linear.size());
}

void fromModel(ImageF& values, ModelSpace space)
{
    if (space == ModelSpace::Display) io::decodeCurve(io::Curve::Srgb, values.data(), values.size());
}

std::optional<double> noiseUnevenness(std::span<const ImageF> frames)
{
    if (frames.size() < 3) return std::nullopt;
    const ImageF scene = matte::shorterHalfMean(frames);
    std::vector<float> sorted(scene.values().begin(), scene.values().end());
    std::sort(sorted.begin(), sorted.end());
    std::array<float, steps> upTo;
    for (std::size_t s = 0; s < steps; ++s) upTo[s] = sorted[(s + 1) * (sorted.size() - 1) / steps];

    std::array<std::vector<float>, steps> depths;
    for (const ImageF& frame : frames)
        for (std::size_t i = 0; i < scene.size(); ++i)
            if (const float depth = scene.data()[i] - frame.data()[i]; depth > rounding * std::abs(scene.data()[i])) {
                const auto step = std::lower_bound(upTo.begin(), upTo.end() - 1, scene.data()[i]) - upTo.begin();
                depths[std::size_t(step)].push_back(depth);
            }
    std::vector<double> logs;
    for (std::vector<float>& some : depths) {
        if (some.size() < fewestSamples) continue;
        const auto middle = some.begin() + std::ptrdiff_t(some.size() / 2);
        std::nth_element(some.begin(), middle, some.end());
        if (*middle > 0.0f) logs.push_back(std::log(double(*middle)));
    }
    if (logs.size() < 3) return std::nullopt;
    double mean = 0.0, square = 0.0;
    for (const double value : logs) mean += value / double(logs.size());
    for (const double value : logs) square += (value - mean) * (value - mean) / double(logs.size());
    return std::sqrt(square);
}

}  // namespace virga::shot
