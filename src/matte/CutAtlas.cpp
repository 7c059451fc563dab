#include "matte/CutAtlas.h"

#include <algorithm>
#include <array>
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

// Weights of the four pixels around a point, f past the second (Catmull and Rom 1974). They sum to 1, so mass is kept,
// and unlike linear ones they leave no dark bands where a slanted ridge passes between pixels.
std::array<double, 4> cubic(double f)
{
    return {f * (-0.5 + f * (1 - 0.5 * f)), 1 + f * f * (-2.5 + 1.5 * f), f * (0.5 + f * (2 - 1.5 * f)),
            f * f * (-0.5 + 0.5 * f)};
}

double sample(const ImageF& image, double x, double y)
{
    const double i = std::floor(x), j = std::floor(y);
    const std::array<double, 4> across = cubic(x - i), down = cubic(y - j);
    double sum = 0;
    for (int q = 0; q < 4; ++q) {
        const float* row = image.row(std::clamp(int(j) + q - 1, 0, image.height() - 1));
        for (int p = 0; p < 4; ++p) {
            const float value = row[std::clamp(int(i) + p - 1, 0, image.width() - 1)];
            if (std::isfinite(value)) sum += across[std::size_t(p)] * down[std::size_t(q)] * value;
        }
    }
    return sum;
}

bool overlap(const RainStroke& a, const RainStroke& b)
{
    if (a.frame != b.frame) return false;
    const double s = std::sin(a.slant), c = std::cos(a.slant), dx = b.x - a.x, dy = b.y - a.y;
    return std::abs(dx * c - dy * s) < (a.width + b.width) / 2 && std::abs(dx * s + dy * c) < (a.length + b.length) / 2;
}

// A drop is gone in the next frame; what is there still, a few pixels on, is a leg or a branch.
bool returns(const RainStroke& a, const RainStroke& b)
{
    const auto alike = [](double p, double q) { return p < 1.4 * q && q < 1.4 * p; };
    return std::abs(a.frame - b.frame) == 1 && std::hypot(a.x - b.x, a.y - b.y) < 6 && alike(a.length, b.length) &&
           alike(a.width, b.width) && alike(a.contrast, b.contrast);
}

int medianSize(std::vector<double> sizes, int least, int most)
{
    std::nth_element(sizes.begin(), sizes.begin() + std::ptrdiff_t(sizes.size() / 2), sizes.end());
    return std::clamp(4 * int(std::ceil(sizes[sizes.size() / 2] / 4)), least, most);
}

void check(const CutAtlasOptions& options)
{
    if (options.count < 1 || options.count > 4096)
        throw Error(ErrorCode::InvalidArgument, "a stroke atlas of {} mattes: 1..4096 are possible", options.count);
    if (options.width < 0 || options.height < 0 || options.width > 1024 || options.height > 1024)
        throw Error(ErrorCode::InvalidArgument, "tiles of {}x{} texels: 0..1024 are possible", options.width,
                    options.height);
    if (!(options.acrossWidths >= 1 && options.acrossWidths <= 16))
        throw Error(ErrorCode::InvalidArgument, "tiles {} strokes wide: 1..16 are possible", options.acrossWidths);
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
        if (std::any_of(strokes.begin(), strokes.end(),
                        [&](const RainStroke& other) { return returns(other, stroke); }))
            continue;
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
    check(options);
    const std::vector<RainStroke> best = bestStrokes(strokes, options.count);
    if (best.empty())
        throw Error(ErrorCode::Input, "no rain to cut an atlas from: {} strokes found, none whole and clear",
                    strokes.size());
    return atlasOf(alphas, best, options);
}

KeptStroke keepStroke(const ImageF& alpha, const RainStroke& stroke, double acrossWidths)
{
    const TileExtent extent = tileExtent(stroke, acrossWidths);
    const int reach = int(std::ceil(std::hypot(extent.across, extent.along) / 2)) + 3;  // the cubic's
    const int left = std::clamp(int(stroke.x) - reach, 0, alpha.width() - 1);
    const int top = std::clamp(int(stroke.y) - reach, 0, alpha.height() - 1);
    const int right = std::clamp(int(stroke.x) + reach, left, alpha.width() - 1);
    const int bottom = std::clamp(int(stroke.y) + reach, top, alpha.height() - 1);
    KeptStroke kept{stroke, ImageF(right - left + 1, bottom - top + 1, 1)};
    for (int y = top; y <= bottom; ++y) std::copy_n(alpha.row(y) + left, kept.alpha.width(), kept.alpha.row(y - top));
    kept.stroke.frame = 0;
    kept.stroke.x -= left;
    kept.stroke.y -= top;
    return kept;
}

StrokeAtlas atlasOf(std::span<const ImageF> alphas, std::span<const RainStroke> best, const CutAtlasOptions& options)
{
    check(options);
    for (const RainStroke& stroke : best)
        if (stroke.frame < 0 || std::size_t(stroke.frame) >= alphas.size())
            throw Error(ErrorCode::Internal, "a stroke of frame {} of {}", stroke.frame, alphas.size());
    if (best.empty()) throw Error(ErrorCode::Input, "no strokes to make an atlas of");
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
