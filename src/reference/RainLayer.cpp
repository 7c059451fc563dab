#include "reference/RainLayer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>

#include "core/Parallel.h"
#include "reference/DropSampler.h"
#include "reference/UndrawnRain.h"

namespace virga::reference {
namespace {

/// Fragments in memory at a time, about: a picture of more is made in bands of rows.
constexpr double mostFragments = 4e6;

/// All fragments of rows [firstRow, lastRow), by pixel, from near to far.
std::vector<Fragment> fragmentsOf(const Scene& scene, const SamplerTables& tables, const DropPaths& paths,
                                  ConstImageViewF depth, int firstRow, int lastRow, std::size_t& strokes)
{
    std::vector<Fragment> all;
    std::mutex mutex;
    const auto grain = std::ptrdiff_t(paths.cells() / 64 + 1);  // a sampler has buffers of the picture's size
    parallelFor(0, std::ptrdiff_t(paths.cells()), grain, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        DropSampler sampler(scene, tables, depth);
        std::vector<Fragment> fragments;
        std::size_t count = 0;
        for (std::ptrdiff_t cell = first; cell < last; ++cell)
            paths.forCell(std::size_t(cell), [&](const DropPath& path) {
                const std::size_t before = fragments.size();
                sampler.sample(path, firstRow, lastRow, fragments);
                count += fragments.size() > before;
            });
        const std::lock_guard lock(mutex);
        all.insert(all.end(), fragments.begin(), fragments.end());
        strokes += count;
    });
    std::sort(all.begin(), all.end(), [](const Fragment& a, const Fragment& b) {
        return std::tie(a.pixel, a.depth, a.drop) < std::tie(b.pixel, b.depth, b.drop);
    });
    return all;
}

/// What thinned strokes leave out, as a smooth part of the layer.
class Veil {
public:
    explicit Veil(const Scene& scene)
    {
        constexpr int nodes = 512;
        const Rain& rain = scene.rain;
        for (int i = 0; i < nodes; ++i)
            depths_.push_back(rain.visibility.far_m * std::pow(double(i) / (nodes - 1), 2.0));
        sums_ = thinnedOpticalDepths(depths_, *rain.thinnedSizes, *rain.field, rain.visibility,
                                     scene.exposure.projection.fullFocal_px(), scene.exposure.duration_s);
        clear_ = {0};
        for (double& sum : sums_) sum *= rain.opacity;
        for (std::size_t i = 1; i < depths_.size(); ++i) {
            const double fog = scene.air.opticalDepth ? scene.air.opticalDepth(0.5 * (depths_[i - 1] + depths_[i])) : 0;
            clear_.push_back(clear_.back() + (sums_[i] - sums_[i - 1]) * std::exp(-fog));
        }
    }

    struct Sums {
        double optical, clear;  // clear: share of its light that the fog in front lets through
    };
    Sums to(double depth) const
    {
        const auto above = std::upper_bound(depths_.begin() + 1, depths_.end() - 1, depth);
        const auto i = std::size_t(above - depths_.begin());
        const double t = std::clamp((depth - depths_[i - 1]) / (depths_[i] - depths_[i - 1]), 0.0, 1.0);
        const double optical = std::lerp(sums_[i - 1], sums_[i], t);
        return {optical, optical > 0 ? std::lerp(clear_[i - 1], clear_[i], t) / optical : 1};
    }

private:
    std::vector<double> depths_, sums_, clear_;
};

void addVeil(const Scene& scene, ConstImageViewF depth, const ImageD& lit, const ImageD& fogLight, ImageD& rain)
{
    const Veil veil(scene);
    for (int y = 0; y < rain.height(); ++y)
        for (int x = 0; x < rain.width(); ++x) {
            const Veil::Sums sums = veil.to(depth.empty() ? scene.rain.visibility.far_m : double(depth.at(x, y)));
            double* pixel = rain.pixel(x, y);
            const double shows = (1 - pixel[3]) * -std::expm1(-sums.optical);
            for (int c = 0; c < 3; ++c)
                pixel[c] += shows * std::lerp(fogLight.at(x, y, c), lit.at(x, y, c), sums.clear);
            pixel[3] += shows;
        }
}

}  // namespace

RainLayer rainLayer(const Scene& scene, ConstImageViewF depth, const ImageD& lit, const ImageD& fogLight)
{
    const int width = scene.exposure.projection.width, height = scene.exposure.projection.height;
    RainLayer layer{ImageD(width, height, 4), ImageD(width, height, 1, std::numeric_limits<double>::infinity()),
                    ImageD(width, height, 2), 0};
    if (scene.rain.field == nullptr) return layer;
    const DropPaths paths(scene);
    const SamplerTables tables(scene);
    const int bands = std::clamp(int(2 * double(paths.drops()) / mostFragments) + 1, 1, height);
    for (int band = 0; band < bands; ++band) {
        const int firstRow = height * band / bands, lastRow = height * (band + 1) / bands;
        for (const Fragment& f : fragmentsOf(scene, tables, paths, depth, firstRow, lastRow, layer.strokes)) {
            double* rain = layer.rain.data() + 4 * f.pixel;
            const double* light = lit.data() + 3 * f.pixel;
            const double* fog = fogLight.data() + 3 * f.pixel;
            const double shows = (1 - rain[3]) * f.alpha;
            for (int c = 0; c < 3; ++c) rain[c] += shows * (f.clear * light[c] + (1 - f.clear) * fog[c] + f.lamps[c]);
            rain[3] += shows;
            double& nearest = layer.depth.data()[f.pixel];
            if (f.alpha < visibleInData || nearest < f.depth) continue;
            nearest = f.depth;
            layer.motion.data()[2 * f.pixel] = f.motion.x;
            layer.motion.data()[2 * f.pixel + 1] = f.motion.y;
        }
    }
    if (scene.rain.thinnedSizes != nullptr) addVeil(scene, depth, lit, fogLight, layer.rain);
    return layer;
}

}  // namespace virga::reference
