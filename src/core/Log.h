// Everything that is said to the user while working goes to standard error through here.
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace virga::log {

enum class Level { Quiet, Normal, Verbose };

void setLevel(Level level);
/// From here on each line is a JSON object with time, level and sentence, for whoever collects logs.
void useJsonLines();

void writeInfo(std::string_view sentence);     ///< Normal and Verbose
void writeDetail(std::string_view sentence);   ///< Verbose alone
void writeWarning(std::string_view sentence);  ///< all but Quiet; something was repaired, guessed or left out
/// A sentence (Normal and above: writeInfo; Verbose: writeDetail) with fields, which JSON lines have beside it.
void writeFields(Level level, std::string_view sentence,
                 std::initializer_list<std::pair<std::string_view, std::string>> fields);

template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args)
{
    writeInfo(fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void detail(fmt::format_string<Args...> format, Args&&... args)
{
    writeDetail(fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warning(fmt::format_string<Args...> format, Args&&... args)
{
    writeWarning(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace virga::log
