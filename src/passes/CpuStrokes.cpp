#include "passes/CpuStrokes.h"

#include <algorithm>
#include <cmath>
#include <glm/packing.hpp>
#include <glm/vec2.hpp>
#include <limits>

#include "core/Simd.h"

namespace virga::passes::cpu {
namespace {

VIRGA_INLINE float acrossIntegral(float x)
{
    x = std::clamp(x, -1.0f, 1.0f);
    return 0.5f + 0.75f * x - 0.25f * x * x * x;
}

/// The rows that a stroke crosses, and how it lies in them. Rows are picture rows where it is steep, else columns.
struct Walk {
    bool steep;
    int firstRow, lastRow;                           // one past the last
    int firstColumn, lastColumn;                     // that may be written
    float middle, slope, halfWidth, start, stretch;  // halfWidth: where the path does not move aside
    float end, insideHalfWidth, insideInverse;  // row where the mass ends; half width in rows crossed whole, and 1 / it
    bool isDownwards;                           // v grows with the row
    const float* prefix;
    float prefixRows;
    const float* densities;

    /// Where the path crosses so much of a row.
    VIRGA_INLINE float halfWidthOver(float rows) const
    {
        const float aside = slope * rows;
        return std::sqrt(halfWidth * halfWidth + 0.41666667f * aside * aside);
    }
};

VIRGA_INLINE Walk walkOf(const Frame& frame, const shared::Stroke& stroke, const BandSums& band)
{
    glm::vec2 a(stroke.path.x, stroke.path.y), b(stroke.path.z, stroke.path.w);
    glm::vec2 way = b - a;
    Walk walk;
    walk.steep = std::abs(way.y) >= std::abs(way.x);
    if (!walk.steep) {
        std::swap(a.x, a.y);
        std::swap(b.x, b.y);
        std::swap(way.x, way.y);
    }
    const float size = std::sqrt(way.x * way.x + way.y * way.y);
    const bool moves = size > 1e-3f;  // what hardly moves is walked downwards as it is
    const float cosine = moves ? std::abs(way.y) / size : 1.0f;
    walk.slope = moves ? way.x / way.y : 0.0f;
    walk.halfWidth = stroke.body.x / cosine;
    const float top = std::min(a.y, b.y) - stroke.body.x * cosine;
    const float bottom = std::max(a.y, b.y) + stroke.body.x * cosine;
    walk.middle = 0.5f * (a.x + b.x) - walk.slope * 0.5f * (a.y + b.y);
    walk.start = top;
    walk.stretch = 1.0f / std::max(bottom - top, 1e-3f);
    walk.end = top + std::max(bottom - top, 1e-3f);
    walk.insideHalfWidth = walk.halfWidthOver(1.0f);
    walk.insideInverse = 1.0f / walk.insideHalfWidth;
    walk.isDownwards = b.y >= a.y;
    const int lowRow = walk.steep ? band.firstRow : 0, highRow = walk.steep ? band.lastRow : frame.width();
    walk.firstRow = int(std::clamp(std::floor(top - stroke.look.w), float(lowRow), float(highRow)));
    walk.lastRow = int(std::clamp(std::floor(bottom + stroke.look.w) + 1.0f, float(lowRow), float(highRow)));
    walk.firstColumn = walk.steep ? 0 : band.firstRow;
    walk.lastColumn = walk.steep ? frame.width() : band.lastRow;
    const std::size_t layer = std::size_t(std::abs(stroke.look.x)) - 1;
    walk.prefix = frame.mattes.prefix.data() + layer * (std::size_t(frame.mattes.height) + 1);
    walk.prefixRows = float(frame.mattes.height);
    walk.densities =
        frame.mattes.densities.data() + layer * std::size_t(frame.mattes.height) * std::size_t(frame.mattes.width);
    return walk;
}

VIRGA_INLINE float alongIntegral(const Walk& walk, float v)
{
    const float at = std::clamp(v, 0.0f, 1.0f) * walk.prefixRows;
    const int k = std::min(int(at), int(walk.prefixRows) - 1);
    return walk.prefix[k] + (walk.prefix[k + 1] - walk.prefix[k]) * (at - float(k));
}

/// Share of the stroke's mass that lies before row coordinate `row`.
VIRGA_INLINE float massBefore(const Walk& walk, float row)
{
    const float v = (row - walk.start) * walk.stretch;
    return walk.isDownwards ? alongIntegral(walk, v) : 1.0f - alongIntegral(walk, 1.0f - v);
}

/// The matte at u, v: bilinear between texel centres, held at the edges.
float densityAt(const Frame& frame, const float* densities, float u, float v)
{
    const int width = frame.mattes.width, height = frame.mattes.height;
    const float x = std::clamp(u * float(width) - 0.5f, 0.0f, float(width - 1));
    const float y = std::clamp(v * float(height) - 0.5f, 0.0f, float(height - 1));
    const int left = std::min(int(x), std::max(width - 2, 0)), top = std::min(int(y), std::max(height - 2, 0));
    const int right = std::min(left + 1, width - 1), bottom = std::min(top + 1, height - 1);
    const auto row = [&](int r) {
        const float* texels = densities + std::size_t(r) * std::size_t(width);
        return texels[left] + (texels[right] - texels[left]) * (x - float(left));
    };
    return row(top) + (row(bottom) - row(top)) * (y - float(top));
}

/// What is added is decided here once for a kind of frame, not for each pixel.
template <bool HasFog, bool HasDepth, bool HasNearest, bool HasLamps>
struct Splat {
    const Frame& frame;
    const shared::Stroke& stroke;
    const glm::vec3* lamps;  // of the stroke
    BandSums& band;

    VIRGA_INLINE void deposit(int x, int y, float alpha, float depth) const
    {
        if constexpr (HasDepth)
            if (depth > frame.depth.row(y)[x]) return;
        const float optical = opticalDepthOf(alpha) * opticalDepthSteps;
        const std::uint32_t whole = steps(optical);
        if (whole == 0) return;
        const std::size_t pixel = std::size_t(y - band.firstRow) * std::size_t(frame.width()) + std::size_t(x);
        constexpr std::size_t lampSums = HasFog ? 2 : 1, perPixel = lampSums + (HasLamps ? 3 : 0);
        std::uint32_t* sums = band.sums.data() + perPixel * pixel;
        sums[0] += whole;
        if constexpr (HasFog) sums[1] += steps(optical * stroke.look.y);
        if constexpr (HasLamps)
            for (int k = 0; k < 3; ++k) sums[lampSums + std::size_t(k)] += steps(optical * (*lamps)[k]);
        if constexpr (HasNearest) {
            float& nearest = band.nearestDepth[pixel];
            if (alpha < visibleInData || depth > nearest) return;
            const std::uint32_t way = glm::packHalf2x16({stroke.path.z - stroke.path.x, stroke.path.w - stroke.path.y});
            std::uint32_t& motion = band.motion[pixel];
            motion = depth < nearest ? way : std::max(motion, way);
            nearest = depth;
        }
    }

    /// Adds one row; `share`: of the stroke's mass that falls into it.
    VIRGA_INLINE void row(const Walk& walk, int row, float share) const
    {
        const float mass = stroke.body.y * share;
        if (mass * opticalDepthSteps < 0.5f) return;
        // The part of the row that the stroke crosses, and how far to the side it goes in it. A parabola of half width
        // h has the variance h^2 / 5, a way of length w walked evenly w^2 / 12: variances add.
        const float low = std::max(float(row), walk.start - stroke.look.w);
        const float high = std::min(float(row) + 1.0f, walk.end + stroke.look.w);
        const float centre = 0.5f * (low + high);
        float halfWidth = walk.insideHalfWidth, inverse = walk.insideInverse;
        if (high - low < 1.0f) {
            halfWidth = walk.halfWidthOver(std::max(high - low, 0.0f));
            inverse = 1.0f / halfWidth;
        }
        float v = std::clamp((centre - walk.start) * walk.stretch, 0.0f, 1.0f);
        if (!walk.isDownwards) v = 1.0f - v;
        const float depth = stroke.body.z + (stroke.body.w - stroke.body.z) * v;
        const float middle = walk.middle + walk.slope * centre;
        // A drop wide and sharp enough shows its matte: the same mass a row, spread as the matte's row is.
        const float tile = 2.0f * stroke.look.z * frame.mattes.acrossDiameters * walk.halfWidth;
        const bool isResolved = tile > resolvedTile && stroke.look.z > 0.75f;
        const float reach = isResolved ? 0.5f * tile : halfWidth;
        const auto first = int(std::clamp(std::floor(middle - reach), float(walk.firstColumn), float(walk.lastColumn)));
        const auto last =
            int(std::clamp(std::floor(middle + reach) + 1.0f, float(walk.firstColumn), float(walk.lastColumn)));
        float before = acrossIntegral((float(first) - middle) * inverse);
        for (int column = first; column < last; ++column) {
            const float after = acrossIntegral((float(column) + 1.0f - middle) * inverse);
            float across = after - before;
            before = after;
            if (isResolved) {
                const float side = stroke.look.x > 0 ? 1.0f : -1.0f;
                const float u = 0.5f + side * (float(column) + 0.5f - middle) / tile;
                across = u < 0 || u > 1 ? 0.0f : densityAt(frame, walk.densities, u, v) / tile;
            }
            const float alpha = std::min(mass * across, 0.998f);
            if (walk.steep)
                deposit(column, row, alpha, depth);
            else
                deposit(row, column, alpha, depth);
        }
    }

    VIRGA_INLINE void all() const
    {
        const Walk walk = walkOf(frame, stroke, band);
        if (stroke.look.w > 0) {  // defocus smears the mass along the path
            const float reach = 0.5f + stroke.look.w;
            for (int r = walk.firstRow; r < walk.lastRow; ++r) {
                const float centre = float(r) + 0.5f;
                row(walk, r, (massBefore(walk, centre + reach) - massBefore(walk, centre - reach)) / (2.0f * reach));
            }
            return;
        }
        float before = massBefore(walk, float(walk.firstRow));
        for (int r = walk.firstRow; r < walk.lastRow; ++r) {
            const float after = massBefore(walk, float(r) + 1.0f);
            row(walk, r, after - before);
            before = after;
        }
    }
};

/// One copy of the loop for each kind of frame, and of each one for AVX2: rounding is an instruction there, else a
/// call.
#define VIRGA_SPLAT_LOOP(name, HasFog, HasDepth, HasNearest, HasLamps)                                        \
    VIRGA_SIMD void name(const Frame& frame, const StrokeList& list, const std::vector<std::uint32_t>& which, \
                         BandSums& band)                                                                      \
    {                                                                                                         \
        for (const std::uint32_t number : which)                                                              \
            Splat<HasFog, HasDepth, HasNearest, HasLamps>{frame, list.items[number],                          \
                                                          HasLamps ? &list.lamps[number] : nullptr, band}     \
                .all();                                                                                       \
    }
VIRGA_SPLAT_LOOP(splat0, false, false, false, false)
VIRGA_SPLAT_LOOP(splat1, true, false, false, false)
VIRGA_SPLAT_LOOP(splat2, false, true, false, false)
VIRGA_SPLAT_LOOP(splat3, true, true, false, false)
VIRGA_SPLAT_LOOP(splat4, false, false, true, false)
VIRGA_SPLAT_LOOP(splat5, true, false, true, false)
VIRGA_SPLAT_LOOP(splat6, false, true, true, false)
VIRGA_SPLAT_LOOP(splat7, true, true, true, false)
VIRGA_SPLAT_LOOP(splat8, false, false, false, true)
VIRGA_SPLAT_LOOP(splat9, true, false, false, true)
VIRGA_SPLAT_LOOP(splat10, false, true, false, true)
VIRGA_SPLAT_LOOP(splat11, true, true, false, true)
VIRGA_SPLAT_LOOP(splat12, false, false, true, true)
VIRGA_SPLAT_LOOP(splat13, true, false, true, true)
VIRGA_SPLAT_LOOP(splat14, false, true, true, true)
VIRGA_SPLAT_LOOP(splat15, true, true, true, true)
#undef VIRGA_SPLAT_LOOP

}  // namespace

void splatStrokes(const Frame& frame, const StrokeList& list, std::size_t bandNumber, BandSums& band)
{
    using Loop = void (*)(const Frame&, const StrokeList&, const std::vector<std::uint32_t>&, BandSums&);
    constexpr Loop loops[16] = {splat0, splat1, splat2,  splat3,  splat4,  splat5,  splat6,  splat7,
                                splat8, splat9, splat10, splat11, splat12, splat13, splat14, splat15};
    const Features& f = frame.features;
    loops[(f.fog ? 1 : 0) + (f.depth ? 2 : 0) + (f.nearest ? 4 : 0) + (f.lights ? 8 : 0)](
        frame, list, list.ofBand[bandNumber], band);
}

}  // namespace virga::passes::cpu
