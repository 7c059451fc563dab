// Patterns that name one file a frame. The number stands in the last part of the path.

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include "core/Error.h"
#include "io/Plate.h"

namespace virga::io {

namespace fs = std::filesystem;

namespace {

/// A pattern cut where the frame number goes.
struct Parts {
    std::string before, after;
    int digits = 1;   // least number of places
    char fill = '0';  // what fills them

    std::string number(FrameNumber of) const
    {
        // As printf does, the sign takes one of the places.
        return fill == '0' ? fmt::format("{:0{}d}", of, digits) : fmt::format("{:{}d}", of, digits);
    }

    /// Only the very name that number() would give counts: "7" is not a frame of "%04d".
    std::optional<FrameNumber> frameOf(std::string_view name) const
    {
        const std::string head = fs::path(before).filename().string();
        if (name.size() <= head.size() + after.size() || !name.starts_with(head) || !name.ends_with(after))
            return std::nullopt;
        name = name.substr(head.size(), name.size() - head.size() - after.size());
        const std::string_view figures = name.substr(std::min(name.find_first_not_of(' '), name.size()));
        const char* last = figures.data() + figures.size();
        FrameNumber found = 0;
        const auto [end, problem] = std::from_chars(figures.data(), last, found);
        if (problem != std::errc() || end != last || number(found) != name) return std::nullopt;
        return found;
    }
};

std::size_t runLength(const std::string& text, std::size_t at)
{
    const std::size_t end = text.find_first_not_of(text[at], at);
    return (end == std::string::npos ? text.size() : end) - at;
}

/// The placeholder that begins at `at`: its length and the digits that it asks for.
std::optional<std::pair<std::size_t, int>> placeholderAt(const std::string& text, std::size_t at)
{
    const auto isDigit = [&](std::size_t i) {
        return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i]));
    };
    if (text[at] == '#' || text[at] == '@') {
        const std::size_t length = runLength(text, at);
        return std::pair{length, int(length)};
    }
    std::size_t end = at + 1;
    if (text[at] == '%') {
        while (isDigit(end) && end < at + 4) ++end;
        if (end >= text.size() || text[end] != 'd') return std::nullopt;
        const int digits = end == at + 1 ? 1 : std::stoi(text.substr(at + 1, end - at - 1));
        return std::pair{end + 1 - at, std::max(1, digits)};
    }
    if (text[at] == '$' && end < text.size() && text[end] == 'F') {
        const int digits = isDigit(end + 1) ? text[end + 1] - '0' : 1;
        return std::pair{std::size_t(isDigit(end + 1) ? 3 : 2), std::max(1, digits)};
    }
    return std::nullopt;
}

/// Calls use(at, length, digits) for each placeholder in the file's name, in order.
template <class Use>
void forEachPlaceholder(const std::string& pattern, Use&& use)
{
    const std::size_t slash = pattern.rfind('/');
    for (std::size_t at = slash == std::string::npos ? 0 : slash + 1; at < pattern.size();) {
        const auto placeholder = placeholderAt(pattern, at);
        if (placeholder) use(at, placeholder->first, placeholder->second);
        at += placeholder ? placeholder->first : 1;
    }
}

/// The last placeholder of the file's name counts: in "take#2.%04d.exr" that is %04d.
std::optional<Parts> split(const std::string& pattern)
{
    std::optional<Parts> found;
    forEachPlaceholder(pattern, [&](std::size_t at, std::size_t length, int digits) {
        // "%4d" fills with spaces, as printf does; everything else with zeros.
        const bool isSpaced = pattern[at] == '%' && pattern[at + 1] != '0' && pattern[at + 1] != 'd';
        found = Parts{pattern.substr(0, at), pattern.substr(at + length), digits, isSpaced ? ' ' : '0'};
    });
    return found;
}

}  // namespace

std::string framePath(const std::string& pattern, FrameNumber number)
{
    const auto parts = split(pattern);
    if (!parts) return pattern;
    return parts->before + parts->number(number) + parts->after;
}

bool isFramePattern(const std::string& pattern)
{
    std::error_code ignored;
    return split(pattern).has_value() && !fs::is_regular_file(pattern, ignored);
}

void refuseTwoPatterns(const std::string& pattern, ErrorCode code)
{
    if (!isFramePattern(pattern)) return;
    std::string last, before;
    forEachPlaceholder(pattern, [&](std::size_t at, std::size_t length, int) {
        if (last.size() > 1) before = last;
        last = pattern.substr(at, length);
    });
    if (!before.empty())
        throw Error(code, "{}: holds two places for the frame's number, {} and {}; leave one", pattern, before, last);
}

std::optional<FrameNumber> frameNumberOf(const std::string& pattern, const std::string& fileName)
{
    const auto parts = split(pattern);
    return parts ? parts->frameOf(fileName) : std::nullopt;
}

std::vector<FrameNumber> findFrames(const std::string& pattern)
{
    refuseTwoPatterns(pattern, ErrorCode::Input);
    const auto parts = split(pattern);
    std::error_code error;
    if (!parts) return fs::exists(pattern, error) ? std::vector<FrameNumber>{0} : std::vector<FrameNumber>{};

    const fs::path path(pattern);
    const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (!fs::is_directory(folder, error))
        throw Error(ErrorCode::Input, "{}: the folder {} does not exist", pattern, folder.string());

    std::vector<FrameNumber> frames;
    fs::directory_iterator entries(folder, error);
    if (error)
        throw Error(ErrorCode::Input, "{}: the folder {} cannot be read: {}", pattern, folder.string(),
                    error.message());
    for (const auto& entry : entries)
        if (const auto number = parts->frameOf(entry.path().filename().string())) frames.push_back(*number);
    std::sort(frames.begin(), frames.end());
    return frames;
}

}  // namespace virga::io
