#include "matte/SceneTrust.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/Parallel.h"
#include "core/Simd.h"
#include "matte/NoiseMap.h"
#include "matte/PixelRows.h"

namespace virga::matte {
namespace {

constexpr double darkLimit = 3.0, broadLimit = 6.5;  // [sigma], chosen beside the truth of one clip
constexpr double staying = 0.5;                      // of its brightness, in the frames beside
constexpr int darkReach = 1, broadReach = 2, stayReach = 2, margin = 2;
constexpr int tile = 32;            // [px], for the search of evidence that something moves
constexpr double outlier = 4.0;     // [sigma] above the scene, for something wide
constexpr double evidence = 0.005;  // share of a tile's samples, over all frames
constexpr double leastBright = 16;  // of the least noise: what something bright differs by
constexpr int wide = 16;            // [px]
constexpr std::size_t mostSamples = 400'000;

// Windows 2 reach + 1 wide and high, first down, then across; what leaves the picture is left out.

VIRGA_SIMD void addRow(const float* __restrict row, int width, float* __restrict to)
{
    for (int x = 0; x < width; ++x) to[x] += row[x];
}

VIRGA_SIMD void raiseRow(const float* __restrict row, int width, float* __restrict to)
{
    for (int x = 0; x < width; ++x) to[x] = to[x] < row[x] ? row[x] : to[x];
}

/// `beside` begins `reach` before the row.
VIRGA_SIMD void meanAcross(const float* __restrict beside, int reach, const float* __restrict share, float rows,
                           int width, float* __restrict to)
{
    for (int x = 0; x < width; ++x) to[x] = beside[x];
    for (int t = 1; t <= 2 * reach; ++t)
        for (int x = 0; x < width; ++x) to[x] += beside[x + t];
    for (int x = 0; x < width; ++x) to[x] *= share[x] / rows;
}

/// A row with room for `reach` beside it, filled with `outside`.
class WideRow {
public:
    WideRow(int width, int reach, float outside) : reach_(reach), values_(std::size_t(width + 2 * reach), outside) {}
    float* row() { return values_.data() + reach_; }
    const float* beside() const { return values_.data(); }

private:
    int reach_;
    std::vector<float> values_;
};

enum class Terms { All, Shortfalls };  // of a row, that are summed

VIRGA_SIMD void addShortfalls(const float* __restrict row, int width, float* __restrict to)
{
    for (int x = 0; x < width; ++x) to[x] += row[x] < 0.0f ? row[x] : 0.0f;
}

/// Window means, of all values or of those below 0, a row at a time.
class WindowMean {
public:
    WindowMean(const ImageF& image, int reach, Terms terms)
        : image_(image), reach_(reach), terms_(terms), sum_(image.width(), reach, 0.0f),
          share_(std::size_t(image.width())), mean_(std::size_t(image.width()))
    {
        const int width = image.width();
        for (int x = 0; x < width; ++x)
            share_[std::size_t(x)] = 1.0f / float(std::min(width - 1, x + reach) - std::max(0, x - reach) + 1);
    }

    /// Good until the next call.
    const float* row(int y)
    {
        const int first = std::max(0, y - reach_), last = std::min(image_.height() - 1, y + reach_);
        std::fill_n(sum_.row(), image_.width(), 0.0f);
        for (int t = first; t <= last; ++t)
            (terms_ == Terms::All ? addRow : addShortfalls)(image_.row(t), image_.width(), sum_.row());
        meanAcross(sum_.beside(), reach_, share_.data(), float(last - first + 1), image_.width(), mean_.data());
        return mean_.data();
    }

private:
    const ImageF& image_;
    int reach_;
    Terms terms_;
    WideRow sum_;
    std::vector<float> share_, mean_;
};

/// The largest in the window, of the rows that `isWanted` names; `to` is of the same size.
template <class Wanted>
void windowMost(const ImageF& image, int reach, const Wanted& isWanted, ImageF& to)
{
    const int width = image.width(), height = image.height();
    WideRow most(width, reach, std::numeric_limits<float>::lowest());
    for (int y = 0; y < height; ++y) {
        if (!isWanted(y)) continue;
        const int first = std::max(0, y - reach), last = std::min(height - 1, y + reach);
        std::copy_n(image.row(first), width, most.row());
        for (int t = first + 1; t <= last; ++t) raiseRow(image.row(t), width, most.row());
        std::copy_n(most.beside(), width, to.row(y));
        for (int t = 1; t <= 2 * reach; ++t) raiseRow(most.beside() + t, width, to.row(y));
    }
}

VIRGA_SIMD int countBelow(const float* row, int count, float limit)
{
    int below = 0;
    for (int x = 0; x < count; ++x) below += row[x] < limit;
    return below;
}

VIRGA_SIMD int countAbove(const float* row, int count, float limit)
{
    int above = 0;
    for (int x = 0; x < count; ++x) above += row[x] > limit;
    return above;
}

/// So many samples of each tile are below the scene with all that is around them. One pixel alone that is dark says
/// that the scene is too bright there.
Image<int> darkSamples(const ImageF& difference, int columns, int rows, float limit)
{
    Image<int> counts(columns, rows, 1);
    WindowMean dark(difference, darkReach, Terms::Shortfalls);
    for (int y = 0; y < difference.height(); ++y) {
        const float* row = dark.row(y);
        for (int c = 0; c < columns; ++c) {
            const int left = c * tile, right = std::min(difference.width(), left + tile);
            counts.at(c, y / tile) += countBelow(row + left, right - left, -limit);
        }
    }
    return counts;
}

/// So many samples of each tile end a square of `wide` x `wide` that is above the scene as a whole: more than strokes
/// are across.
Image<int> wideSamples(const ImageF& difference, int columns, int rows, float limit)
{
    Image<int> counts(columns, rows, 1);
    std::vector<int> down(static_cast<std::size_t>(difference.width()));
    for (int y = 0; y < difference.height(); ++y) {
        const float* row = difference.row(y);
        if (countAbove(row, difference.width(), limit) < wide) {
            std::fill(down.begin(), down.end(), 0);
            continue;
        }
        int across = 0;
        for (int x = 0; x < difference.width(); ++x) {
            across = row[x] > limit ? across + 1 : 0;
            int& height = down[std::size_t(x)];
            height = across >= wide ? height + 1 : 0;
            counts.at(x / tile, y / tile) += height >= wide;
        }
    }
    return counts;
}

/// 1 for the tiles in and beside which something moves, a pixel a tile: something dark, or something wide and bright
/// that is there in the frames before and after too.
Image<char> tilesWithEvidence(const std::vector<ImageF>& differences, double sigma, double leastNoise)
{
    const int width = differences[0].width(), height = differences[0].height();
    const int columns = (width + tile - 1) / tile, rows = (height + tile - 1) / tile;
    const std::size_t count = differences.size();
    std::vector<Image<int>> dark(count), bright(count);
    const auto wideLimit = float(std::max(outlier * sigma, leastBright * leastNoise));
    parallelFor(0, std::ptrdiff_t(count), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            dark[k] = darkSamples(differences[k], columns, rows, float(darkLimit * sigma));
            bright[k] = wideSamples(differences[k], columns, rows, wideLimit);
        }
    });
    const auto near = [&](int c, int r, const auto& body) {
        for (int v = std::max(0, r - 1); v <= std::min(rows - 1, r + 1); ++v)
            for (int u = std::max(0, c - 1); u <= std::min(columns - 1, c + 1); ++u) body(u, v);
    };
    Image<char> seen(columns, rows, 1), tiles(columns, rows, 1);
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
            std::int64_t moving = 0;
            for (std::size_t k = 0; k < count; ++k) {
                moving += dark[k].at(c, r);
                const auto stays = [&](std::size_t beside) {
                    int there = 0;
                    near(c, r, [&](int u, int v) { there += bright[beside].at(u, v); });
                    return there > 0;
                };
                if (bright[k].at(c, r) > 0 && (k == 0 || stays(k - 1)) && (k + 1 == count || stays(k + 1)))
                    moving += bright[k].at(c, r);
            }
            const int right = std::min(width, (c + 1) * tile), bottom = std::min(height, (r + 1) * tile);
            const double samples = double(right - c * tile) * (bottom - r * tile) * double(count);
            seen.at(c, r) = double(moving) > evidence * samples;
        }
    for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) near(c, r, [&](int u, int v) { tiles.at(c, r) |= seen.at(u, v); });
    return tiles;
}

/// 1 where something shows, 0 elsewhere.
VIRGA_SIMD void mark(const float* __restrict dark, const float* broad, const float* before, const float* after,
                     std::size_t count, float darkest, float brightest, float* __restrict marks)
{
    for (std::size_t i = 0; i < count; ++i) {
        const float stays = float(staying) * broad[i];
        const bool isBright = (broad[i] > brightest) & (before[i] > stays) & (after[i] > stays);
        marks[i] = (dark[i] < darkest) | isBright ? 1.0f : 0.0f;
    }
}

VIRGA_SIMD void complement(float* values, std::size_t count)
{
    for (std::size_t i = 0; i < count; ++i) values[i] = 1.0f - values[i];
}

/// The tiles in which something moves. Most rows of most pictures have none, and need no look.
class Tiles {
public:
    explicit Tiles(const Image<char>& seen) : seen_(seen)
    {
        for (int r = 0; r < seen.height(); ++r)
            isInRow_.push_back(std::any_of(seen.row(r), seen.row(r) + seen.width(), [](char is) { return is != 0; }));
    }
    /// Whether a tile has a row within `reach` of this one.
    bool touch(int y, int reach) const
    {
        const int first = std::max(0, y - reach) / tile, last = std::min((y + reach) / tile, seen_.height() - 1);
        return std::any_of(isInRow_.begin() + first, isInRow_.begin() + last + 1, [](bool is) { return is; });
    }
    /// 0 outside of the tiles.
    void keep(int y, int width, float* marks) const
    {
        for (int c = 0; c < seen_.width(); ++c)
            if (!seen_.at(c, y / tile)) std::fill(marks + c * tile, marks + std::min(width, (c + 1) * tile), 0.0f);
    }

private:
    const Image<char>& seen_;
    std::vector<bool> isInRow_;
};

/// windowMost of the broad means, of the rows with tiles. broad: room.
void mostAround(const ImageF& difference, const Tiles& tiles, ImageF& broad, ImageF& most)
{
    WindowMean mean(difference, broadReach, Terms::All);
    for (int y = 0; y < difference.height(); ++y)
        if (tiles.touch(y, stayReach)) std::copy_n(mean.row(y), difference.width(), broad.row(y));
    windowMost(
        broad, stayReach, [&](int y) { return tiles.touch(y, 0); }, most);
}

/// Trust, in place of the difference. before, after: mostAround of the frames beside; where there is none the frame's
/// own broad mean, which always stays; both null: nothing can stay. marks: room.
void trustOf(ImageF& difference, const ImageF* before, const ImageF* after, const Tiles& tiles, double sigma,
             ImageF& marks)
{
    const int width = difference.width(), height = difference.height();
    const bool isAlone = before == nullptr && after == nullptr;
    const float brightest = isAlone ? std::numeric_limits<float>::infinity() : float(broadLimit * sigma);
    WindowMean broad(difference, broadReach, Terms::All), dark(difference, darkReach, Terms::Shortfalls);
    for (int y = 0; y < height; ++y) {
        if (!tiles.touch(y, 0)) {
            std::fill_n(marks.row(y), width, 0.0f);
            continue;
        }
        const float *wide = broad.row(y), *low = dark.row(y);
        mark(low, wide, before ? before->row(y) : wide, after ? after->row(y) : wide, std::size_t(width),
             float(-darkLimit * sigma), brightest, marks.row(y));
        tiles.keep(y, width, marks.row(y));
    }
    for (int y = 0; y < height; ++y)
        if (!tiles.touch(y, margin)) std::fill_n(difference.row(y), width, 0.0f);
    windowMost(
        marks, margin, [&](int y) { return tiles.touch(y, margin); }, difference);
    complement(difference.data(), difference.size());
}

}  // namespace

double noiseLevel(std::span<const ImageF> frames, const ImageF& scene, double repeated)
{
    std::vector<float> below;
    const std::size_t stride = frames.size() * scene.size() / mostSamples + 1;
    std::size_t at = 0;  // goes on from frame to frame, so that no column is left out
    for (const ImageF& frame : frames) {
        for (; at < frame.size(); at += stride)
            if (const float depth = scene.data()[at] - frame.data()[at]; depth > 0.0f) below.push_back(depth);
        at -= frame.size();
    }
    return darkDeviation(below, repeated);
}

namespace {

/// What sceneTrust looks at: how far the frames' means are from the scene's, and where something moves.
struct Evidence {
    std::vector<ImageF> differences;
    double sigma = 0;
    Image<char> tiles;

    bool isEmpty() const
    {
        return std::none_of(tiles.values().begin(), tiles.values().end(), [](char seen) { return seen != 0; });
    }
};

Evidence evidenceIn(std::span<const ImageF> frames, const ImageF& scene, double leastNoise)
{
    assert(scene.channels() == 1 || scene.channels() == 3);
    Evidence found;
    found.differences.resize(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            ImageF& difference = found.differences[k];
            difference = ImageF(scene.width(), scene.height(), 1);
            meanDifference(frames[k].data(), scene.data(), scene.channels(), difference.size(), difference.data());
        }
    });
    const ImageF none(scene.width(), scene.height(), 1);
    found.sigma = std::max(noiseLevel(found.differences, none, leastNoise), leastNoise);
    found.tiles = tilesWithEvidence(found.differences, found.sigma, leastNoise);
    return found;
}

}  // namespace

bool somethingMoves(std::span<const ImageF> frames, const ImageF& scene, double leastNoise)
{
    return !frames.empty() && !evidenceIn(frames, scene, leastNoise).isEmpty();
}

std::vector<ImageF> sceneTrust(std::span<const ImageF> frames, const ImageF& scene, double leastNoise)
{
    const auto count = std::ptrdiff_t(frames.size());
    if (frames.empty()) return {};
    Evidence seen = evidenceIn(frames, scene, leastNoise);
    if (seen.isEmpty()) return {};
    const Tiles tiles(seen.tiles);
    const auto room = [&] { return ImageF(scene.width(), scene.height(), 1); };
    std::vector<ImageF> most(frames.size()), trust = std::move(seen.differences);
    parallelFor(0, count, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        ImageF broad = room();
        for (auto k = std::size_t(first); k < std::size_t(last); ++k) {
            most[k] = room();
            mostAround(trust[k], tiles, broad, most[k]);
        }
    });
    parallelFor(0, count, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        ImageF marks = room();
        for (auto k = std::size_t(first); k < std::size_t(last); ++k)
            trustOf(trust[k], k > 0 ? &most[k - 1] : nullptr, k + 1 < frames.size() ? &most[k + 1] : nullptr, tiles,
                    seen.sigma, marks);
    });
    return trust;
}

}  // namespace virga::matte
