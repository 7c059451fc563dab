// Words that a user mistyped.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace virga {

/// ASCII letters made small; others stay.
std::string lowerCase(std::string_view text);

/// Letters to add, drop or exchange to make one word of the other (Levenshtein 1966).
std::size_t editDistance(std::string_view a, std::string_view b);

/// The known word with the fewest changed letters, or empty if none is close: within two, or a third of the word.
std::string nearestWord(std::string_view word, std::span<const std::string> known);

}  // namespace virga
