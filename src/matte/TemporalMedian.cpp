#include "matte/TemporalMedian.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <utility>
#include <vector>

#include "core/Parallel.h"
#include "core/Simd.h"

namespace virga::matte {
namespace {

constexpr std::ptrdiff_t tile = 128;  // values that are sorted side by side
using Row = std::array<float, tile>;
using Pack = PackOf<float>;

/// Pairs to compare and exchange, in order, that sort `count` values whatever they are: merge exchange (Batcher 1968;
/// Knuth, The Art of Computer Programming 3, algorithm 5.2.2M).
std::vector<std::pair<int, int>> sortingNetwork(int count)
{
    std::vector<std::pair<int, int>> pairs;
    if (count < 2) return pairs;
    const int top = int(std::bit_ceil(unsigned(count))) / 2;
    for (int p = top; p > 0; p /= 2) {
        int q = top, r = 0, d = p;
        while (true) {
            for (int i = 0; i + d < count; ++i)
                if ((i & p) == r) pairs.emplace_back(i, i + d);
            if (q == p) break;
            d = q - p;
            q /= 2;
            r = p;
        }
    }
    return pairs;
}

/// Those of the pairs that the values in the middle depend on.
std::vector<std::pair<int, int>> medianNetwork(int count)
{
    std::vector<std::pair<int, int>> kept;
    std::vector<bool> isNeeded(std::size_t(count), false);
    isNeeded[std::size_t((count - 1) / 2)] = isNeeded[std::size_t(count / 2)] = true;
    const auto pairs = sortingNetwork(count);
    for (auto pair = pairs.rbegin(); pair != pairs.rend(); ++pair) {
        const auto low = std::size_t(pair->first), high = std::size_t(pair->second);
        if (!isNeeded[low] && !isNeeded[high]) continue;
        isNeeded[low] = isNeeded[high] = true;
        kept.push_back(*pair);
    }
    std::reverse(kept.begin(), kept.end());
    return kept;
}

VIRGA_SIMD void exchange(Row* rows, const std::pair<int, int>* pairs, std::size_t count)
{
    for (std::size_t n = 0; n < count; ++n) {
        float *a = rows[pairs[n].first].data(), *b = rows[pairs[n].second].data();
        for (std::ptrdiff_t i = 0; i < tile; i += Pack::lanes) {
            const Pack::Type x = Pack::at(a + i), y = Pack::at(b + i);
            Pack::at(a + i) = y < x ? y : x;
            Pack::at(b + i) = y < x ? x : y;
        }
    }
}

/// body(rows, to, length) for pieces of the picture: `rows` holds each piece's values sorted over the frames, row by
/// row, as far as `network` sorts them, and `to` is where the piece lies in the result.
template <class Body>
ImageF overSorted(std::span<const ImageF> frames, const std::vector<std::pair<int, int>>& network, Body&& body)
{
    assert(!frames.empty());
    ImageF result(frames[0].width(), frames[0].height(), frames[0].channels());
    const std::size_t count = frames.size();
    const std::ptrdiff_t size = std::ptrdiff_t(result.size()), tiles = (size + tile - 1) / tile;
    parallelFor(0, tiles, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<Row> rows(count);
        for (std::ptrdiff_t t = first; t < last; ++t) {
            const std::ptrdiff_t begin = t * tile, length = std::min(tile, size - begin);
            for (std::size_t k = 0; k < count; ++k) std::copy_n(frames[k].data() + begin, length, rows[k].begin());
            exchange(rows.data(), network.data(), network.size());
            body(rows, result.data() + begin, std::size_t(length));
        }
    });
    return result;
}

}  // namespace

ImageF temporalMedian(std::span<const ImageF> frames)
{
    return overSorted(frames, medianNetwork(int(frames.size())),
                      [](const std::vector<Row>& rows, float* to, std::size_t length) {
                          const Row &below = rows[(rows.size() - 1) / 2], &above = rows[rows.size() / 2];
                          for (std::size_t i = 0; i < length; ++i) to[i] = 0.5f * (below[i] + above[i]);
                      });
}

ImageF shorterHalfMean(std::span<const ImageF> frames)
{
    return overSorted(frames, sortingNetwork(int(frames.size())),
                      [](const std::vector<Row>& rows, float* to, std::size_t length) {
                          const std::size_t half = std::min(rows.size() / 2 + 1, rows.size());
                          Row sum{}, best{}, shortest;
                          for (std::size_t k = 0; k < half; ++k)
                              for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += rows[k][i];
                          best = sum;
                          for (std::size_t i = 0; i < sum.size(); ++i) shortest[i] = rows[half - 1][i] - rows[0][i];
                          for (std::size_t k = half; k < rows.size(); ++k) {
                              const Row &entering = rows[k], &leaving = rows[k - half], &lowest = rows[k - half + 1];
                              for (std::size_t i = 0; i < sum.size(); ++i) {
                                  sum[i] += entering[i] - leaving[i];
                                  const float span = entering[i] - lowest[i];
                                  best[i] = span < shortest[i] ? sum[i] : best[i];
                                  shortest[i] = std::min(span, shortest[i]);
                              }
                          }
                          for (std::size_t i = 0; i < length; ++i) to[i] = best[i] / float(half);
                      });
}

ImageF lowerQuarterMean(std::span<const ImageF> frames)
{
    return overSorted(frames, sortingNetwork(int(frames.size())),
                      [](const std::vector<Row>& rows, float* to, std::size_t length) {
                          const std::size_t last = std::max<std::size_t>(rows.size() / 4, 1), first = last > 1 ? 1 : 0;
                          Row sum{};
                          for (std::size_t k = first; k < last; ++k)
                              for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += rows[k][i];
                          for (std::size_t i = 0; i < length; ++i) to[i] = sum[i] / float(last - first);
                      });
}

}  // namespace virga::matte
