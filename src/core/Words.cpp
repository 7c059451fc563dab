#include "core/Words.h"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>
#include <vector>

namespace virga {

std::string lowerCase(std::string_view text)
{
    std::string result(text);
    std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::tolower(c); });
    return result;
}

std::size_t editDistance(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> row(b.size() + 1);  // of the table of distances between beginnings, one row at a time
    std::iota(row.begin(), row.end(), std::size_t(0));
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t kept = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = std::exchange(row[j], std::min({kept, row[j] + 1, row[j - 1] + 1}));
        }
    }
    return row.back();
}

std::string nearestWord(std::string_view word, std::span<const std::string> known)
{
    std::string nearest;
    std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string& candidate : known) {
        const std::size_t distance = editDistance(word, candidate);
        if (distance < least) {
            least = distance;
            nearest = candidate;
        }
    }
    return nearest;
}

std::string onOneLine(std::string_view text)
{
    std::string line(text);
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
    return line;
}

std::string firstLine(std::string_view text) { return std::string(text.substr(0, text.find('\n'))); }

std::string shortened(std::string_view text, std::size_t most)
{
    return text.size() <= most ? std::string(text) : std::string(text.substr(0, most)) + "...";
}

bool isNestedDeeper(std::string_view json, std::size_t levels) noexcept
{
    std::size_t depth = 0;
    bool isInString = false;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const char c = json[i];
        if (c == '"') isInString = !isInString;
        if (isInString && c == '\\') ++i;
        if (isInString) continue;
        if ((c == '[' || c == '{') && ++depth > levels) return true;
        if ((c == ']' || c == '}') && depth > 0) --depth;
    }
    return false;
}

}  // namespace virga
