#include "depth/DepthImage.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <vector>

#include "core/Error.h"
#include "core/Parallel.h"

namespace virga::depth {
namespace {

constexpr float kSky = std::numeric_limits<float>::infinity();
constexpr float kHole = -1;

// Writes into every hole the value of the nearest pixel that is none: the exact Euclidean distance transform of
// Felzenszwalb & Huttenlocher 2004 ("Distance transforms of sampled functions"), carrying the place along. First the
// nearest in the same column, then, along each row, the lower envelope of the parabolas (x - q)^2 + distance(q)^2.
void fillHoles(ImageF& image)
{
    const int W = image.width(), H = image.height();
    constexpr int kNone = -1;
    Image<int> nearestRow(W, H, 1, kNone);
    for (int y = 0; y < H; ++y)
        for (int x = 0; x < W; ++x)
            nearestRow.at(x, y) = image.at(x, y) != kHole ? y : y > 0 ? nearestRow.at(x, y - 1) : kNone;
    for (int y = H - 2; y >= 0; --y)
        for (int x = 0; x < W; ++x) {
            const int above = nearestRow.at(x, y), below = nearestRow.at(x, y + 1);
            if (below != kNone && (above == kNone || below - y < y - above)) nearestRow.at(x, y) = below;
        }

    const ImageF known = image;
    parallelFor(0, H, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<int> centre(W);
        std::vector<double> from(W + 1);
        for (int y = int(first); y < int(last); ++y) {
            const int* rows = nearestRow.row(y);
            const auto height = [&](int q) { return double(rows[q] - y) * (rows[q] - y) + double(q) * q; };
            int parabolas = 0;
            for (int q = 0; q < W; ++q) {
                if (rows[q] == kNone) continue;
                double meet = -std::numeric_limits<double>::infinity();
                while (parabolas > 0) {
                    const int p = centre[parabolas - 1];
                    meet = (height(q) - height(p)) / (2.0 * (q - p));
                    if (meet > from[parabolas - 1]) break;
                    meet = -std::numeric_limits<double>::infinity();
                    --parabolas;
                }
                centre[parabolas] = q;
                from[parabolas] = meet;
                ++parabolas;
            }
            for (int x = 0, k = 0; x < W; ++x) {
                if (known.at(x, y) != kHole) continue;
                while (k + 1 < parabolas && from[k + 1] < x) ++k;
                image.at(x, y) = parabolas > 0 ? known.at(centre[k], rows[centre[k]]) : kSky;
            }
        }
    });
}

/// Colour as the eye sees differences, near enough: square roots of the light.
std::array<float, 3> encoded(const float* rgb)
{
    const auto root = [](float v) { return v > 0 ? std::sqrt(std::min(v, 4.0f)) : 0.0f; };  // NaN becomes 0
    return {root(rgb[0]), root(rgb[1]), root(rgb[2])};
}

/// Mean encoded colour of the picture over each pixel of a smaller one.
ImageF reducedGuide(ConstImageViewF guide, int width, int height)
{
    ImageF reduced(width, height, 3);
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const int top = int(std::int64_t(y) * guide.height() / height);
            const int bottom = std::max(int(std::int64_t(y + 1) * guide.height() / height), top + 1);
            for (int x = 0; x < width; ++x) {
                const int left = int(std::int64_t(x) * guide.width() / width);
                const int right = std::max(int(std::int64_t(x + 1) * guide.width() / width), left + 1);
                std::array<float, 3> sum{};
                for (int j = top; j < bottom; ++j)
                    for (int i = left; i < right; ++i)
                        for (int c = 0; c < 3; ++c) sum[std::size_t(c)] += encoded(guide.pixel(i, j))[std::size_t(c)];
                for (int c = 0; c < 3; ++c)
                    reduced.at(x, y, c) = sum[std::size_t(c)] / float((bottom - top) * (right - left));
            }
        }
    });
    return reduced;
}

/// The depth, of the nine around place (sx, sy), whose surroundings in the picture look most like `color`.
float alikeDepth(const ImageF& depth, const ImageF& reduced, const std::array<float, 3>& color, double sx, double sy)
{
    constexpr float distanceCost = 0.002f;  // of a whole pixel away: decides where colours do not
    const int middleX = int(std::lround(sx)), middleY = int(std::lround(sy));
    float best = depth.at(middleX, middleY), least = std::numeric_limits<float>::infinity();
    for (int j = std::max(middleY - 1, 0); j <= std::min(middleY + 1, depth.height() - 1); ++j)
        for (int i = std::max(middleX - 1, 0); i <= std::min(middleX + 1, depth.width() - 1); ++i) {
            const double dx = i - sx, dy = j - sy;
            float cost = distanceCost * float(dx * dx + dy * dy);
            for (int c = 0; c < 3; ++c) {
                const float difference = reduced.at(i, j, c) - color[std::size_t(c)];
                cost += difference * difference;
            }
            if (cost < least) {
                least = cost;
                best = depth.at(i, j);
            }
        }
    return best;
}

}  // namespace

namespace {

void requirePositive(const char* name, double value)
{
    if (!(value > 0) || !std::isfinite(value))
        throw Error(ErrorCode::InvalidArgument, "depth {} {} is not a number above 0", name, value);
}

/// Depth, or its inverse, as a linear function of what is stored.
struct Coding {
    double slope, offset;
    bool isInverse;

    explicit Coding(const DepthOptions& o)
        : slope(o.scale), offset(o.offset), isInverse(o.kind == DepthKind::Inverse || o.kind == DepthKind::Disparity)
    {
        requirePositive("scale", o.scale);
        if (!std::isfinite(o.offset))
            throw Error(ErrorCode::InvalidArgument, "depth offset {} is not a number", o.offset);
        if (o.kind == DepthKind::Disparity || o.kind == DepthKind::Distance)
            requirePositive("focal length", o.focal_px);
        if (o.kind == DepthKind::Inverse) {
            slope = 1 / o.scale;
            offset = o.offset / o.scale;
        } else if (o.kind == DepthKind::Disparity) {
            requirePositive("baseline", o.baseline_m);
            slope = o.scale / (o.baseline_m * o.focal_px);
            offset = o.offset / (o.baseline_m * o.focal_px);
        }
        if (!o.range) return;
        const auto [first, last] = *o.range;
        requirePositive("range", first);
        requirePositive("range", last);
        requirePositive("full scale", o.full);
        if (o.kind == DepthKind::Disparity)
            throw Error(ErrorCode::InvalidArgument, "disparity has a baseline, not a depth range");
        offset = isInverse ? 1 / first : first;
        slope = ((isInverse ? 1 / last : last) - offset) / o.full;
    }

    double at(double stored) const { return slope * stored + offset; }
};

/// From distances along the rays to depths along the axis.
void putOnAxis(ImageF& metres, double focal_px)
{
    for (int y = 0; y < metres.height(); ++y)
        for (int x = 0; x < metres.width(); ++x) {
            const double u = x + 0.5 - 0.5 * metres.width(), v = y + 0.5 - 0.5 * metres.height();
            metres.at(x, y) *= float(focal_px / std::hypot(focal_px, u, v));
        }
}

}  // namespace

Depth sanitizeDepth(ConstImageViewF stored, const DepthOptions& options)
{
    const Coding coding(options);
    if (!(options.skyBeyond > 0))
        throw Error(ErrorCode::InvalidArgument, "depth sky distance {} is not above 0", options.skyBeyond);
    if (stored.empty() || stored.channels() < 1) throw Error(ErrorCode::Input, "the depth image has no pixels");

    Depth depth;
    depth.metres = ImageF(stored.width(), stored.height(), 1);
    DepthCounts& counts = depth.counts;
    counts.pixels = std::int64_t(stored.width()) * stored.height();
    for (int y = 0; y < stored.height(); ++y)
        for (int x = 0; x < stored.width(); ++x) {
            const double value = stored.at(x, y);
            float& out = depth.metres.at(x, y);
            const double coded = coding.at(value), metres = coding.isInverse ? 1 / coded : coded;
            if (std::isnan(value))
                out = kHole, ++counts.nan;
            else if (options.noValue && value == *options.noValue)
                out = kHole, ++counts.noValue;
            else if ((coding.isInverse ? coded == 0 : value >= options.skyStored) ||
                     metres >= options.skyBeyond)  // 1 / -0 is no hole either
                out = kSky, ++counts.infinite;
            else if (!(float(metres) > 0))
                out = kHole, ++counts.nonPositive;
            else
                out = float(metres);
        }
    counts.filled = counts.nan + counts.nonPositive + counts.noValue;
    if (counts.filled > 0) fillHoles(depth.metres);
    if (options.kind == DepthKind::Distance) putOnAxis(depth.metres, options.focal_px);
    return depth;
}

Depth resampleDepth(Depth depth, int width, int height, ConstImageViewF guide, double tolerance)
{
    if (width < 1 || height < 1)
        throw Error(ErrorCode::InvalidArgument, "a depth image cannot be resampled to {}x{}", width, height);
    if (depth.metres.width() == width && depth.metres.height() == height) return depth;
    const ImageF source = std::move(depth.metres);
    depth.resampled = true;
    depth.metres = ImageF(width, height, 1);
    assert(guide.empty() || (guide.width() == width && guide.height() == height && guide.channels() >= 3));
    const ImageF reduced = guide.empty() ? ImageF() : reducedGuide(guide, source.width(), source.height());
    const double stepX = double(source.width()) / width, stepY = double(source.height()) / height;
    const int lastX = source.width() - 1, lastY = source.height() - 1;
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const double sy = std::clamp((y + 0.5) * stepY - 0.5, 0.0, double(lastY));
            const int y0 = int(sy), y1 = std::min(y0 + 1, lastY);
            const double fy = sy - y0;
            for (int x = 0; x < width; ++x) {
                const double sx = std::clamp((x + 0.5) * stepX - 0.5, 0.0, double(lastX));
                const int x0 = int(sx), x1 = std::min(x0 + 1, lastX);
                const double fx = sx - x0;
                const float a = source.at(x0, y0), b = source.at(x1, y0), c = source.at(x0, y1), d = source.at(x1, y1);
                const float nearest = fy < 0.5 ? (fx < 0.5 ? a : b) : (fx < 0.5 ? c : d);
                const auto [low, high] = std::minmax({a, b, c, d});
                const bool edge = std::isinf(high) || high > low * (1 + tolerance);
                if (edge && high > low && !guide.empty())
                    depth.metres.at(x, y) = alikeDepth(source, reduced, encoded(guide.pixel(x, y)), sx, sy);
                else if (edge)
                    depth.metres.at(x, y) = nearest;
                else
                    depth.metres.at(x, y) =
                        float(1 / ((1 - fy) * ((1 - fx) / a + fx / b) + fy * ((1 - fx) / c + fx / d)));
            }
        }
    });
    return depth;
}

DepthStatistics depthStatistics(ConstImageViewF metres)
{
    std::vector<float> finite;
    for (int y = 0; y < metres.height(); ++y)
        for (int x = 0; x < metres.width(); ++x)
            if (std::isfinite(metres.at(x, y))) finite.push_back(metres.at(x, y));
    if (finite.empty()) return {kSky, kSky, kSky, 0};
    const auto middle = finite.begin() + std::ptrdiff_t(finite.size() / 2);
    std::nth_element(finite.begin(), middle, finite.end());
    const auto [low, high] = std::minmax_element(finite.begin(), finite.end());
    return {*low, *middle, *high, std::int64_t(finite.size())};
}

}  // namespace virga::depth
