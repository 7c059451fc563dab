#include "matte/TemporalMedian.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>
#include <vector>

#include "core/Parallel.h"
#include "matte/SortingNetwork.h"

namespace virga::matte {
namespace {

constexpr std::ptrdiff_t tile = 128;  // values that are sorted side by side
using Row = std::array<float, tile>;
static_assert(sizeof(Row) == tile * sizeof(float));

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
            exchangeRows(rows[0].data(), tile, network);
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
