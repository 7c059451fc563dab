#include "matte/StrokeAtlas.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/Error.h"

namespace virga::matte {
namespace {

constexpr double kLengthWhereUnknown = 20;  // diameters: a drop of 1.5 mm in 1/180 s

float smoothstep(float from, float to, float x)
{
    const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

// The entry of a prefix table between its samples; outside, the end that is nearer.
double between(const float* prefix, std::ptrdiff_t step, int intervals, double position)
{
    const double x = std::clamp(position, 0.0, double(intervals));
    const int i = std::min(int(x), intervals - 1);
    const double f = x - i;
    return (1 - f) * prefix[i * step] + f * prefix[(i + 1) * step];
}

}  // namespace

double plainMean(double lengthDiameters, double acrossDiameters) noexcept
{
    // The time that the drop spends over all points is the area of its disc, pi/4 D^2, whatever its path. Dividing by
    // the physical peak min(1, D / s) and by the tile's area acrossDiameters D (s + D), with s = (length - 1) D:
    const double path = lengthDiameters - 1;
    return std::numbers::pi / 4 / acrossDiameters * std::max(1.0, path) / lengthDiameters;
}

void finishAtlas(StrokeAtlas& atlas)
{
    const int N = atlas.count(), W = atlas.width, L = atlas.height;
    if (N == 0 || N != atlas.groups * atlas.variants || W <= 0 || L <= 0 || atlas.layers.width() != W ||
        atlas.layers.height() != N * L || atlas.layers.channels() != 1 || !(atlas.acrossDiameters > 0))
        throw Error(ErrorCode::Internal,
                    "a stroke atlas of {} mattes of {}x{} in {} groups of {} does not fit {}x{} texels", N, W, L,
                    atlas.groups, atlas.variants, atlas.layers.width(), atlas.layers.height());

    atlas.alongProfile.assign(std::size_t(N) * L, 0);
    atlas.alongPrefix.assign(std::size_t(N) * (L + 1), 0);
    atlas.summedArea.assign(std::size_t(N) * (L + 1) * (W + 1), 0);
    std::vector<double> above(W + 1);
    for (int n = 0; n < N; ++n) {
        const ImageView<float> tile = atlas.layer(n);
        float peak = 0;
        for (int y = 0; y < L; ++y)
            for (int x = 0; x < W; ++x) {
                if (!std::isfinite(tile.at(x, y)))
                    throw Error(ErrorCode::Input, "stroke matte {} holds a value that is not finite at ({}, {})", n, x,
                                y);
                tile.at(x, y) = std::max(tile.at(x, y), 0.0f);
                peak = std::max(peak, tile.at(x, y));
            }
        if (!(peak > 0)) throw Error(ErrorCode::Input, "stroke matte {} is empty: no value above 0", n);

        std::fill(above.begin(), above.end(), 0.0);
        double along = 0;
        for (int y = 0; y < L; ++y) {
            double left = 0;
            float* sums = atlas.summedArea.data() + (std::size_t(n) * (L + 1) + y + 1) * (W + 1);
            for (int x = 0; x < W; ++x) {
                tile.at(x, y) /= peak;
                left += tile.at(x, y);
                above[x + 1] += left;
                sums[x + 1] = float(above[x + 1]);
            }
            const double profile = left / W * atlas.acrossDiameters;
            along += profile / L;
            atlas.alongProfile[std::size_t(n) * L + y] = float(profile);
            atlas.alongPrefix[std::size_t(n) * (L + 1) + y + 1] = float(along);
        }
        StrokeMatte& matte = atlas.mattes[n];
        const double length = matte.lengthDiameters > 1 ? matte.lengthDiameters : kLengthWhereUnknown;
        matte.mass = float(above[W] / (double(W) * L) / plainMean(length, atlas.acrossDiameters));
    }
}

float oscillationStrength(float diameter) noexcept
{
    const float mm = 1e3f * diameter;
    return smoothstep(0.8f, 1.4f, mm) * (1 - 0.5f * smoothstep(1.6f, 2.6f, mm));
}

int strokeLayer(const StrokeAtlas& atlas, float beadCycles, float strength, float random) noexcept
{
    int group = 0;
    if (beadCycles > 0) {
        const float place = atlas.groupsPerOctave * std::log2(beadCycles / atlas.firstBeadCycles);
        group = int(std::clamp(std::floor(place + 0.5f), 0.0f, float(atlas.groups - 1)));
    }
    // An atlas that knows nothing about oscillations deals all its mattes to everybody.
    const float few = std::min(2.0f, float(atlas.variants));
    const float choices = atlas.groups == 1 ? float(atlas.variants)
                                            : few + std::clamp(strength, 0.0f, 1.0f) * (float(atlas.variants) - few);
    const int variant = std::clamp(int(random * choices), 0, atlas.variants - 1);
    return group * atlas.variants + variant;
}

double boxMean(const StrokeAtlas& atlas, int n, double u0, double u1, double v0, double v1)
{
    const int W = atlas.width, L = atlas.height;
    const float* sums = atlas.summedArea.data() + std::size_t(n) * (L + 1) * (W + 1);
    const auto corner = [&](double u, double v) {
        const double row = std::clamp(v * L, 0.0, double(L));
        const int r = std::min(int(row), L - 1);
        const double f = row - r;
        return (1 - f) * between(sums + std::ptrdiff_t(r) * (W + 1), 1, W, u * W) +
               f * between(sums + std::ptrdiff_t(r + 1) * (W + 1), 1, W, u * W);
    };
    const double sum = corner(u1, v1) - corner(u0, v1) - corner(u1, v0) + corner(u0, v0);
    return sum / ((u1 - u0) * W * (v1 - v0) * L);
}

double alongMean(const StrokeAtlas& atlas, int n, double v0, double v1)
{
    const float* prefix = atlas.alongPrefix.data() + std::size_t(n) * (atlas.height + 1);
    return (between(prefix, 1, atlas.height, v1 * atlas.height) - between(prefix, 1, atlas.height, v0 * atlas.height)) /
           (v1 - v0);
}

}  // namespace virga::matte
