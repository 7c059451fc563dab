#include "matte/CutAtlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::matte {
namespace {

constexpr double kSmallestWidth = 1.5;  // [px]: thinner strokes are a pixel's own width
constexpr double kSample = 0.2;         // [px], the spacing of the points that a texel is the mean of

double smoothFade(double inside, double over)
{
    const double t = over > 0 ? std::clamp(inside / over, 0.0, 1.0) : inside > 0 ? 1.0 : 0.0;
    return t * t * (3 - 2 * t);
}

double sample(const ImageF& image, double x, double y)
{
    x = std::clamp(x, 0.0, image.width() - 1.0), y = std::clamp(y, 0.0, image.height() - 1.0);
    const int i = int(x), j = int(y);
    const int right = std::min(i + 1, image.width() - 1), below = std::min(j + 1, image.height() - 1);
    const double f = x - i, g = y - j;
    const auto at = [&](int p, int q) { return std::isfinite(image.at(p, q)) ? double(image.at(p, q)) : 0.0; };
    return (1 - g) * ((1 - f) * at(i, j) + f * at(right, j)) + g * ((1 - f) * at(i, below) + f * at(right, below));
}

bool overlap(const RainStroke& a, const RainStroke& b)
{
    if (a.frame != b.frame) return false;
    const double s = std::sin(a.slant), c = std::cos(a.slant), dx = b.x - a.x, dy = b.y - a.y;
    return std::abs(dx * c - dy * s) < (a.width + b.width) / 2 && std::abs(dx * s + dy * c) < (a.length + b.length) / 2;
}

int medianSize(std::vector<double> sizes, int least, int most)
{
    std::nth_element(sizes.begin(), sizes.begin() + std::ptrdiff_t(sizes.size() / 2), sizes.end());
    return std::clamp(4 * int(std::ceil(sizes[sizes.size() / 2] / 4)), least, most);
}

}  // namespace

std::vector<RainStroke> bestStrokes(std::span<const RainStroke> strokes, int count)
{
    std::vector<std::size_t> order(strokes.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return strokes[a].score > strokes[b].score; });
    std::vector<RainStroke> best;
    for (const std::size_t n : order) {
        if (int(best.size()) >= count) break;
        const RainStroke& stroke = strokes[n];
        if (!stroke.inside || !(stroke.score > 0)) continue;
        if (std::none_of(best.begin(), best.end(), [&](const RainStroke& other) { return overlap(other, stroke); }))
            best.push_back(stroke);
    }
    return best;
}

TileExtent tileExtent(const RainStroke& stroke, double acrossWidths) noexcept
{
    const double width = std::max(stroke.width, kSmallestWidth);
    return {acrossWidths * width, stroke.length + std::max(width, 2.0)};
}

ImageF cutStroke(const ImageF& alpha, const RainStroke& stroke, int width, int height, double acrossWidths)
{
    const TileExtent extent = tileExtent(stroke, acrossWidths);
    const double du = extent.across / width, dv = extent.along / height;
    const int nu = std::max(2, int(std::ceil(du / kSample))), nv = std::max(2, int(std::ceil(dv / kSample)));
    const double s = std::sin(stroke.slant), c = std::cos(stroke.slant);
    const double margin = (extent.along - stroke.length) / 2, halfAcross = extent.across / 2;
    ImageF tile(width, height, 1);
    for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i) {
            double sum = 0;
            for (int q = 0; q < nv; ++q) {
                const double v = (j + (q + 0.5) / nv) * dv - extent.along / 2;
                const double ends = smoothFade(extent.along / 2 - std::abs(v), margin / 2);
                for (int p = 0; p < nu; ++p) {
                    const double u = (i + (p + 0.5) / nu) * du - halfAcross;
                    // The neighbour begins at the valley: half a pixel of fade on this side of it.
                    const double own = smoothFade((u < 0 ? stroke.reachLeft : stroke.reachRight) - std::abs(u), 0.5);
                    const double sides = smoothFade(halfAcross - std::abs(u), 0.2 * halfAcross);
                    sum += ends * own * sides *
                           (sample(alpha, stroke.x + u * c + v * s, stroke.y - u * s + v * c) - stroke.background);
                }
            }
            tile.at(i, j) = float(sum / (nu * nv));
        }
    return tile;
}

StrokeAtlas cutAtlas(std::span<const ImageF> alphas, std::span<const RainStroke> strokes,
                     const CutAtlasOptions& options)
{
    if (options.count < 1 || options.count > 4096)
        throw Error(ErrorCode::InvalidArgument, "a stroke atlas of {} mattes: 1..4096 are possible", options.count);
    if (options.width < 0 || options.height < 0 || options.width > 1024 || options.height > 1024)
        throw Error(ErrorCode::InvalidArgument, "tiles of {}x{} texels: 0..1024 are possible", options.width,
                    options.height);
    if (!(options.acrossWidths >= 1 && options.acrossWidths <= 16))
        throw Error(ErrorCode::InvalidArgument, "tiles {} strokes wide: 1..16 are possible", options.acrossWidths);
    for (const RainStroke& stroke : strokes)
        if (stroke.frame < 0 || std::size_t(stroke.frame) >= alphas.size())
            throw Error(ErrorCode::Internal, "a stroke of frame {} of {}", stroke.frame, alphas.size());

    const std::vector<RainStroke> best = bestStrokes(strokes, options.count);
    if (best.empty())
        throw Error(ErrorCode::Input, "no rain to cut an atlas from: {} strokes found, none whole and clear",
                    strokes.size());
    std::vector<double> across, along;
    for (const RainStroke& stroke : best) {
        const TileExtent extent = tileExtent(stroke, options.acrossWidths);
        across.push_back(extent.across), along.push_back(extent.along);
    }

    StrokeAtlas atlas;
    atlas.width = options.width > 0 ? options.width : medianSize(across, 4, 64);
    atlas.height = options.height > 0 ? options.height : medianSize(along, 16, 256);
    atlas.acrossDiameters = float(options.acrossWidths);
    atlas.variants = int(best.size());
    atlas.mattes.resize(best.size());
    atlas.layers = ImageF(atlas.width, atlas.height * atlas.variants, 1);
    parallelFor(0, atlas.variants, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int n = int(first); n < int(last); ++n) {
            const RainStroke& stroke = best[std::size_t(n)];
            const ImageF tile =
                cutStroke(alphas[std::size_t(stroke.frame)], stroke, atlas.width, atlas.height, options.acrossWidths);
            for (int y = 0; y < atlas.height; ++y) std::copy_n(tile.row(y), atlas.width, atlas.layer(n).row(y));
            StrokeMatte& matte = atlas.mattes[std::size_t(n)];
            matte.lengthPixels = float(stroke.length);
            matte.widthPixels = float(stroke.width);
            matte.exposure = options.exposure;
            matte.lengthDiameters = float(along[std::size_t(n)] * options.acrossWidths / across[std::size_t(n)]);
        }
    });
    finishAtlas(atlas);
    return atlas;
}

}  // namespace virga::matte
