// Words that a user mistyped, and texts that a stranger wrote.
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

/// For a terminal: control characters, line ends among them, become '?'.
std::string onOneLine(std::string_view text);

/// Libraries gather what several layers of them say, a line each; the first is where it went wrong.
std::string firstLine(std::string_view text);

/// The first `most` bytes, with "..." for the rest.
std::string shortened(std::string_view text, std::size_t most = 60);

/// Whether brackets and braces of a JSON text are nested deeper than `levels`: what reads, writes or frees such values
/// by recursion would run out of stack. Our own files need three or four.
bool isNestedDeeper(std::string_view json, std::size_t levels = 100) noexcept;

}  // namespace virga
