#include "io/PlateName.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "core/Error.h"
#include "io/ImageFile.h"
#include "io/Plate.h"

namespace virga::io {

namespace fs = std::filesystem;

namespace {

bool isDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// A file's name around the last number in it.
struct NumberedName {
    std::string before, number, after;
};

/// Nothing if there is no number before the extension. A minus counts if it cannot be a dash: behind a point, an
/// underscore, or nothing.
std::optional<NumberedName> splitName(const std::string& name)
{
    const std::size_t dot = name.rfind('.');
    std::size_t end = dot == std::string::npos ? name.size() : dot;
    while (end > 0 && !isDigit(name[end - 1])) --end;
    std::size_t begin = end;
    while (begin > 0 && isDigit(name[begin - 1])) --begin;
    if (begin == end) return std::nullopt;
    const bool isSigned =
        begin > 0 && name[begin - 1] == '-' && (begin == 1 || name[begin - 2] == '.' || name[begin - 2] == '_');
    if (isSigned) --begin;
    return NumberedName{name.substr(0, begin), name.substr(begin, end - begin), name.substr(end)};
}

/// The sequences that numbers of these names make up: the fewest digits that a number has, and those that are written
/// with so many at least, filled with zeros; the others again.
void addSequences(const std::string& before, std::vector<std::string> numbers, const std::string& after,
                  std::vector<std::pair<std::string, std::vector<std::string>>>& to)
{
    while (!numbers.empty()) {
        const auto shorter = [](const std::string& a, const std::string& b) { return a.size() < b.size(); };
        const std::size_t digits = std::min_element(numbers.begin(), numbers.end(), shorter)->size();
        std::vector<std::string> in, out;
        for (const std::string& number : numbers) {
            const bool isFilled = number.size() > digits && number[number[0] == '-' ? 1 : 0] == '0';
            (isFilled ? out : in).push_back(number);
        }
        to.emplace_back(in.size() == 1 ? before + in[0] + after : fmt::format("{}%0{}d{}", before, digits, after), in);
        numbers = std::move(out);
    }
}

}  // namespace

std::optional<FrameNumber> frameNumberIn(const std::string& path)
{
    const auto parts = splitName(fs::path(path).filename().string());
    if (!parts || (!parts->after.empty() && parts->after.rfind('.') != 0)) return std::nullopt;
    if (!parts->before.empty() && parts->before.back() != '.' && parts->before.back() != '_') return std::nullopt;
    FrameNumber number = 0;
    const char* last = parts->number.data() + parts->number.size();
    const auto [end, error] = std::from_chars(parts->number.data(), last, number);
    return error == std::errc() && end == last ? std::optional(number) : std::nullopt;
}

std::string resolvePlateName(const std::string& path)
{
    std::error_code error;
    if (!fs::is_directory(path, error)) return path;
    fs::directory_iterator entries(path, error);
    if (error) throw Error(ErrorCode::Input, "{}: the folder cannot be read: {}", path, error.message());

    std::map<std::pair<std::string, std::string>, std::vector<std::string>> numbered;
    std::vector<std::pair<std::string, std::vector<std::string>>> found;  // pattern or name, numbers
    for (const auto& entry : entries) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with('.') || !entry.is_regular_file(error) || !isImageName(name)) continue;
        if (const auto parts = splitName(name))
            numbered[{parts->before, parts->after}].push_back(parts->number);
        else
            found.push_back({name, {}});
    }
    for (const auto& [around, numbers] : numbered) addSequences(around.first, numbers, around.second, found);
    if (found.empty())
        throw Error(ErrorCode::Input, "{}: is a folder without images; name a movie, an image or a pattern", path);
    if (found.size() == 1) return (fs::path(path) / found[0].first).string();
    std::sort(found.begin(), found.end());
    constexpr std::size_t most = 6;
    std::string list;
    for (std::size_t i = 0; i < std::min(most, found.size()); ++i) list += (i == 0 ? "" : ", ") + found[i].first;
    if (found.size() > most) list += fmt::format(" and {} more", found.size() - most);
    throw Error(ErrorCode::Input, "{}: is a folder with several sequences or images; name one: {}", path, list);
}

}  // namespace virga::io
