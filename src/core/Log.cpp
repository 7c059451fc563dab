#include "core/Log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>

#include "core/Words.h"

namespace virga::log {
namespace {

std::atomic<bool> writesJson = false;

/// Text of one line between quotes of JSON; what is no ASCII stays as it is.
std::string quoted(std::string_view text)
{
    std::string result = "\"";
    for (const char c : onOneLine(text)) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

spdlog::logger& logger()
{
    static const auto instance = [] {
        auto made = spdlog::stderr_color_mt("virga");
        made->set_pattern("virga: %^%v%$");
        return made;
    }();
    return *instance;
}

/// before: what marks the line for people.
void write(spdlog::level::level_enum level, const char* before, std::string_view sentence,
           std::initializer_list<std::pair<std::string_view, std::string>> fields)
{
    if (!writesJson) return logger().log(level, "{}{}", before, onOneLine(sentence));
    std::string text = "\"sentence\": " + quoted(sentence);
    for (const auto& [name, value] : fields) text += ", " + quoted(name) + ": " + quoted(value);
    logger().log(level, "{}", text);
}

}  // namespace

void setLevel(Level level)
{
    logger().set_level(level == Level::Quiet    ? spdlog::level::err
                       : level == Level::Normal ? spdlog::level::info
                                                : spdlog::level::debug);
}

void useJsonLines()
{
    writesJson = true;
    logger().set_pattern(R"({"time": "%Y-%m-%dT%H:%M:%S.%e%z", "level": "%l", %v})");
}

void writeInfo(std::string_view sentence) { write(spdlog::level::info, "", sentence, {}); }
void writeDetail(std::string_view sentence) { write(spdlog::level::debug, "", sentence, {}); }
void writeWarning(std::string_view sentence) { write(spdlog::level::warn, "warning: ", sentence, {}); }

void writeFields(Level level, std::string_view sentence,
                 std::initializer_list<std::pair<std::string_view, std::string>> fields)
{
    write(level == Level::Verbose ? spdlog::level::debug : spdlog::level::info, "", sentence, fields);
}

}  // namespace virga::log
