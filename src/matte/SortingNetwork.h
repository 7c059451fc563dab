// Sorting many short lists at once, side by side in rows, in an order of comparisons that does not depend on the
// values.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace virga::matte {

/// Pairs to compare and exchange, in order, that sort `count` values whatever they are: merge exchange (Batcher 1968;
/// Knuth, The Art of Computer Programming 3, algorithm 5.2.2M).
std::vector<std::pair<int, int>> sortingNetwork(int count);

/// Those of the pairs that the values in the middle depend on.
std::vector<std::pair<int, int>> medianNetwork(int count);

/// Compares and exchanges whole rows, value by value; row n begins at rows + n length. length: a multiple of 8.
void exchangeRows(float* rows, std::ptrdiff_t length, std::span<const std::pair<int, int>> pairs);

}  // namespace virga::matte
