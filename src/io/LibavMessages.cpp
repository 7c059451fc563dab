// What FFmpeg says: into the detailed log, and what a decoder says of its packets to the Complaints of who opened it.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/log.h>
}

#include <cstdarg>
#include <cstdlib>
#include <mutex>
#include <string_view>

#include "core/Log.h"
#include "io/Libav.h"

namespace virga::io::libav {

void Complaints::add(std::int64_t packetTime)
{
    const std::lock_guard lock(mutex_);
    wrong_.insert(packetTime);
}

void Complaints::addWhole(std::int64_t packetTime)
{
    const std::lock_guard lock(mutex_);
    whole_.insert(packetTime);
    saysWhole_ = true;
}

void Complaints::forget(std::int64_t packetTime)
{
    const std::lock_guard lock(mutex_);
    wrong_.erase(packetTime);
    whole_.erase(packetTime);
}

bool Complaints::has(std::int64_t packetTime) const
{
    const std::lock_guard lock(mutex_);
    return wrong_.contains(packetTime) || (saysWhole_ && !whole_.contains(packetTime));
}

namespace {

/// The codec whose message it is, if it is one with Complaints. A decoder's thread has a copy of the context.
const AVCodecContext* complainer(void* object)
{
    if (object == nullptr || *static_cast<const AVClass**>(object) != avcodec_get_class()) return nullptr;
    const auto* codec = static_cast<const AVCodecContext*>(object);
    return codec->opaque != nullptr ? codec : nullptr;
}

std::string textOf(void* object, int level, const char* format, va_list arguments)
{
    char line[1024];
    int atLineStart = 1;
    av_log_format_line(object, level, format, arguments, line, sizeof line, &atLineStart);
    std::string text(line);
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
    return text;
}

void takeMessage(void* object, int level, const char* format, va_list arguments)
{
    const AVCodecContext* codec = complainer(object);
    auto* complaints = codec != nullptr ? static_cast<Complaints*>(codec->opaque) : nullptr;
    constexpr std::string_view whole = "Decoded frame with POC";  // said by the HEVC decoder
    if (level > AV_LOG_WARNING && (complaints == nullptr || !std::string_view(format).starts_with(whole))) return;
    try {
        if (level > AV_LOG_WARNING) return complaints->addWhole(codec->reordered_opaque);
        if (complaints != nullptr && level <= AV_LOG_ERROR) complaints->add(codec->reordered_opaque);
        if (const std::string text = textOf(object, level, format, arguments); !text.empty()) log::writeDetail(text);
    } catch (...) {  // a message that is lost is better than an exception through C
    }
}

}  // namespace

void routeMessages()
{
    static std::once_flag once;
    std::call_once(once, [] {
        av_log_set_callback(takeMessage);
        setenv("SVT_LOG", "1", 0);  // SVT-AV1 writes to standard error itself: errors alone
    });
}

}  // namespace virga::io::libav
