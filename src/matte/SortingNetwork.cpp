#include "matte/SortingNetwork.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "core/Simd.h"

namespace virga::matte {
namespace {

using Pack = PackOf<float>;

VIRGA_SIMD void exchange(float* rows, std::ptrdiff_t length, const std::pair<int, int>* pairs, std::size_t count)
{
    for (std::size_t n = 0; n < count; ++n) {
        float *a = rows + pairs[n].first * length, *b = rows + pairs[n].second * length;
        for (std::ptrdiff_t i = 0; i < length; i += Pack::lanes) {
            const Pack::Type x = Pack::at(a + i), y = Pack::at(b + i);
            Pack::at(a + i) = y < x ? y : x;
            Pack::at(b + i) = y < x ? x : y;
        }
    }
}

}  // namespace

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

void exchangeRows(float* rows, std::ptrdiff_t length, std::span<const std::pair<int, int>> pairs)
{
    assert(length % Pack::lanes == 0);
    exchange(rows, length, pairs.data(), pairs.size());
}

}  // namespace virga::matte
