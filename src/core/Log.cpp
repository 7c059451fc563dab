#include "core/Log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "core/Words.h"

namespace virga::log {
namespace {

spdlog::logger& logger()
{
    static const auto instance = [] {
        auto made = spdlog::stderr_color_mt("virga");
        made->set_pattern("virga: %^%v%$");
        return made;
    }();
    return *instance;
}

}  // namespace

void setLevel(Level level)
{
    logger().set_level(level == Level::Quiet    ? spdlog::level::err
                       : level == Level::Normal ? spdlog::level::info
                                                : spdlog::level::debug);
}

void writeInfo(std::string_view sentence) { logger().info("{}", onOneLine(sentence)); }
void writeDetail(std::string_view sentence) { logger().debug("{}", onOneLine(sentence)); }
void writeWarning(std::string_view sentence) { logger().warn("warning: {}", onOneLine(sentence)); }

}  // namespace virga::log
