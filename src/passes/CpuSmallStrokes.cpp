#include "passes/CpuSmallStrokes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/Lanes.h"
#include "passes/CpuStrokes.h"

namespace virga::passes::cpu {
namespace {

using lanes::Float;
using lanes::IntVector;
using lanes::Mask;

constexpr float longest = 32, widest = 2;  // [px]: lanes that are done wait for the longest of eight

/// Numbers of eight strokes, to be read or written one by one.
template <class Number>
struct alignas(32) Eight {
    Number of[lanes::count];

    VIRGA_INLINE Number& operator[](int lane) { return of[lane]; }
    VIRGA_INLINE Number operator[](int lane) const { return of[lane]; }
};
VIRGA_INLINE Float load(const Eight<float>& eight) { return lanes::load(eight.of); }
VIRGA_INLINE Eight<float> stored(const Float& a)
{
    Eight<float> eight;
    lanes::store(a, eight.of);
    return eight;
}
/// |a| < 2^31.
VIRGA_INLINE Eight<std::int32_t> whole(const Float& a)
{
    const IntVector v = __builtin_convertvector(a.v, IntVector);
    Eight<std::int32_t> eight;
    std::memcpy(eight.of, &v, sizeof v);
    return eight;
}
VIRGA_INLINE int largest(const Float& a)
{
    const Eight<float> eight = stored(a);
    return int(*std::max_element(eight.of, eight.of + lanes::count));
}

VIRGA_INLINE Float acrossIntegral(const Float& at)
{
    const Float x = lanes::clamp(at, -1.0f, 1.0f);
    return 0.5f + 0.75f * x - 0.25f * x * x * x;
}

/// -ln(1 - alpha). The series is within 1e-8 of it up to 0.06; whole groups of strokes are fainter.
VIRGA_INLINE Float opticalDepths(const Float& alpha)
{
    const Float series =
        alpha * (1.0f + alpha * (0.5f + alpha * (1.0f / 3 + alpha * (0.25f + alpha * (0.2f + alpha * (1.0f / 6))))));
    if (!(alpha > 0.06f).any()) return series;
    return lanes::pick(alpha > 0.06f, -lanes::log(1.0f - alpha), series);
}

/// Eight strokes and the rows of a band that they cross; see Walk of CpuStrokes.cpp, whose names these are.
struct Walks {
    Float middle, slope, halfWidth, start, stretch, end;
    Float firstRow, lastRow;
    Float covered, depthOpen, depthClose, clear;
    Mask isDownwards;
    Eight<const float*> prefix;
};

VIRGA_INLINE Walks walksOf(const Frame& frame, const StrokeList& list, const std::uint32_t* which, int count,
                           const BandSums& band)
{
    Eight<float> ax, ay, bx, by, width, covered, open, close, clear;
    Walks w;
    const std::size_t prefixSize = std::size_t(frame.mattes.height) + 1;
    for (int lane = 0; lane < lanes::count; ++lane) {
        const shared::Stroke& s = list.items[which[std::min(lane, count - 1)]];
        ax[lane] = s.path.x, ay[lane] = s.path.y, bx[lane] = s.path.z, by[lane] = s.path.w;
        width[lane] = s.body.x;
        covered[lane] = lane < count ? s.body.y : 0;
        open[lane] = s.body.z, close[lane] = s.body.w;
        clear[lane] = s.look.y;
        w.prefix[lane] = frame.mattes.prefix.data() + (std::size_t(std::abs(s.look.x)) - 1) * prefixSize;
    }
    const Float x = load(ax), y = load(ay), wayX = load(bx) - x, wayY = load(by) - y, half = load(width);
    const Float size = lanes::sqrt(wayX * wayX + wayY * wayY);
    const Mask moves = size > 1e-3f;  // what hardly moves is walked downwards as it is
    const Float cosine = lanes::pick(moves, lanes::abs(wayY) / size, 1.0f);
    w.slope = lanes::pick(moves, wayX / wayY, 0.0f);
    w.halfWidth = half / cosine;
    w.start = lanes::min(y, load(by)) - half * cosine;
    const Float length = lanes::max(lanes::max(y, load(by)) + half * cosine - w.start, 1e-3f);
    w.end = w.start + length;
    w.stretch = 1.0f / length;
    w.middle = 0.5f * (x + load(bx)) - w.slope * 0.5f * (y + load(by));
    w.isDownwards = wayY >= 0.0f;
    const auto low = float(band.firstRow), high = float(band.lastRow);
    w.firstRow = lanes::clamp(lanes::floor(lanes::clamp(w.start, low - 1, high)), low, high);
    w.lastRow = lanes::clamp(lanes::floor(lanes::clamp(w.end, low - 1, high)) + 1.0f, low, high);
    w.covered = load(covered);
    w.depthOpen = load(open);
    w.depthClose = load(close);
    w.clear = load(clear);
    return w;
}

/// Share of each stroke's mass that lies before its row coordinate.
VIRGA_INLINE Float massBefore(const Walks& w, const Float& row, float prefixRows)
{
    const Float along = (row - w.start) * w.stretch, v = lanes::pick(w.isDownwards, along, 1.0f - along);
    const Float at = lanes::clamp(v, 0.0f, 1.0f) * prefixRows;
    const Float entry = lanes::min(lanes::floor(at), prefixRows - 1);
    const Eight<std::int32_t> k = whole(entry);
    Eight<float> from, to;
    for (int lane = 0; lane < lanes::count; ++lane) {
        from[lane] = w.prefix[lane][k[lane]];
        to[lane] = w.prefix[lane][k[lane] + 1];
    }
    const Float mass = lanes::mix(load(from), load(to), at - entry);
    return lanes::pick(w.isDownwards, mass, 1.0f - mass);
}

/// Adds eight strokes' steps to a pixel each, and to its second sum the weighted steps. Without a branch, which half of
/// the time would be foreseen wrongly: what is hidden or beyond a stroke's end adds 0.
template <bool HasFog, bool HasDepth>
VIRGA_INLINE void deposit(const IntVector& steps, const IntVector& weighted, const Eight<std::int32_t>& pixels,
                          const Eight<float>& depths, const float* sceneDepth, std::uint32_t* sums)
{
    if constexpr (HasFog) {
        // Both sums of a pixel are one 64-bit number: the lower one never overflows (common_frame.glsl).
        static_assert(std::endian::native == std::endian::little);
        typedef std::uint64_t Pairs __attribute__((vector_size(64)));
        const Pairs pairs = __builtin_convertvector((lanes::UintVector)steps, Pairs) |
                            __builtin_convertvector((lanes::UintVector)weighted, Pairs) << 32;
        alignas(64) std::uint64_t added[lanes::count];
        std::memcpy(added, &pairs, sizeof added);
        for (int lane = 0; lane < lanes::count; ++lane) {
            if constexpr (HasDepth) added[lane] &= depths[lane] > sceneDepth[pixels[lane]] ? 0 : ~std::uint64_t{0};
            std::uint64_t pixel;
            std::memcpy(&pixel, sums + 2 * std::ptrdiff_t(pixels[lane]), sizeof pixel);
            pixel += added[lane];
            std::memcpy(sums + 2 * std::ptrdiff_t(pixels[lane]), &pixel, sizeof pixel);
        }
    } else {
        alignas(32) std::uint32_t added[lanes::count];
        std::memcpy(added, &steps, sizeof added);
        for (int lane = 0; lane < lanes::count; ++lane) {
            if constexpr (HasDepth) added[lane] &= depths[lane] > sceneDepth[pixels[lane]] ? 0 : ~0u;
            sums[pixels[lane]] += added[lane];
        }
    }
}

template <bool HasFog, bool HasDepth>
VIRGA_INLINE void splatEight(const Frame& frame, const Walks& w, BandSums& band)
{
    const auto prefixRows = float(frame.mattes.height);
    const int width = frame.width(), rows = largest(w.lastRow - w.firstRow);
    const float* sceneDepth = HasDepth ? frame.depth.row(band.firstRow) : nullptr;
    // In a whole row a stroke is as wide as in none else.
    const Float widest = lanes::sqrt(w.halfWidth * w.halfWidth + 0.41666667f * w.slope * w.slope);
    const int columns = largest(widest * 2.0f + 2.0f);
    Float row = w.firstRow, before = massBefore(w, row, prefixRows);
    for (int r = 0; r < rows; ++r, row = row + 1.0f) {
        const Float after = massBefore(w, row + 1.0f, prefixRows);
        const Mask isOn = row < w.lastRow;
        const Float mass = lanes::pick(isOn, w.covered * (after - before), 0.0f);
        before = after;
        const Float low = lanes::max(row, w.start), high = lanes::min(row + 1.0f, w.end);
        const Float centre = 0.5f * (low + high), aside = w.slope * lanes::max(high - low, 0.0f);
        const Float halfWidth = lanes::sqrt(w.halfWidth * w.halfWidth + 0.41666667f * aside * aside);
        const Float inverse = 1.0f / halfWidth;
        const Float middle = w.middle + w.slope * centre;
        const Float first = lanes::floor(middle - halfWidth);
        Eight<float> depths;
        if constexpr (HasDepth) {
            const Float v = lanes::clamp((centre - w.start) * w.stretch, 0.0f, 1.0f);
            depths = stored(lanes::mix(w.depthOpen, w.depthClose, lanes::pick(w.isDownwards, v, 1.0f - v)));
        }
        Float at = lanes::pick(isOn, (row - float(band.firstRow)) * float(width) + first, 0.0f);
        Float left = acrossIntegral((first - middle) * inverse);
        for (int column = 0; column < columns; ++column, at = at + 1.0f) {
            const Float right = acrossIntegral((first + float(column + 1) - middle) * inverse);
            const Float alpha = lanes::min(mass * (right - left), 0.998f);
            left = right;
            const Float optical = opticalDepths(alpha) * opticalDepthSteps;
            const IntVector steps = __builtin_convertvector((optical + 0.5f).v, IntVector);
            const IntVector weighted =
                HasFog ? __builtin_convertvector((optical * w.clear + 0.5f).v, IntVector) : steps;
            deposit<HasFog, HasDepth>(steps, weighted, whole(at), depths, sceneDepth, band.sums.data());
        }
    }
}

/// A list is larger than the cache, and its bands leave gaps that the processor does not foresee.
VIRGA_INLINE void fetchAhead(const StrokeList& list, const std::vector<std::uint32_t>& which, std::size_t from)
{
    for (std::size_t i = from; i < std::min(from + lanes::count, which.size()); ++i)
        __builtin_prefetch(&list.items[which[i]]);
}

#define VIRGA_SPLAT_LOOP(name, HasFog, HasDepth)                                                              \
    VIRGA_SIMD void name(const Frame& frame, const StrokeList& list, const std::vector<std::uint32_t>& which, \
                         BandSums& band)                                                                      \
    {                                                                                                         \
        for (std::size_t i = 0; i < which.size(); i += lanes::count) {                                        \
            const int count = int(std::min<std::size_t>(lanes::count, which.size() - i));                     \
            fetchAhead(list, which, i + 3 * lanes::count);                                                    \
            splatEight<HasFog, HasDepth>(frame, walksOf(frame, list, which.data() + i, count, band), band);   \
        }                                                                                                     \
    }
VIRGA_SPLAT_LOOP(splatAlone, false, false)
VIRGA_SPLAT_LOOP(splatInFog, true, false)
VIRGA_SPLAT_LOOP(splatInDepth, false, true)
VIRGA_SPLAT_LOOP(splatInFogAndDepth, true, true)
#undef VIRGA_SPLAT_LOOP

}  // namespace

bool isSmall(const Frame& frame, const shared::Stroke& stroke)
{
    const float wayX = std::abs(stroke.path.z - stroke.path.x), wayY = std::abs(stroke.path.w - stroke.path.y);
    const float half = stroke.body.x;
    if (wayX > wayY || wayY > longest || half > widest || stroke.look.w > 0) return false;
    // A cosine is at least the root of a half, so that half widths in a row grow to its inverse, and by the way aside.
    const float reach = 1.5f * half + 1.5f;
    if (std::min(stroke.path.x, stroke.path.z) < reach ||
        std::max(stroke.path.x, stroke.path.z) > float(frame.width()) - reach)
        return false;
    return stroke.look.z <= 0.75f || 3.0f * half * frame.mattes.acrossDiameters <= resolvedTile;
}

void splatSmallStrokes(const Frame& frame, const StrokeList& list, std::size_t bandNumber, BandSums& band)
{
    using Loop = void (*)(const Frame&, const StrokeList&, const std::vector<std::uint32_t>&, BandSums&);
    constexpr Loop loops[4] = {splatAlone, splatInFog, splatInDepth, splatInFogAndDepth};
    loops[(frame.features.fog ? 1 : 0) + (frame.features.depth ? 2 : 0)](frame, list, list.smallOfBand[bandNumber],
                                                                         band);
}

}  // namespace virga::passes::cpu
