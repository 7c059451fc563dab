#include "server/Metrics.h"

#include <fmt/format.h>

#include <algorithm>

namespace virga::server {
namespace {

std::string head(const char* name, const char* type, const char* help)
{
    return fmt::format("# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help);
}

template <class Number>
std::string single(const char* name, const char* type, const char* help, Number value)
{
    return head(name, type, help) + fmt::format("{} {}\n", name, value);
}

}  // namespace

void Metrics::Histogram::add(double seconds)
{
    ++counts[std::size_t(std::lower_bound(bounds_s.begin(), bounds_s.end(), seconds) - bounds_s.begin())];
    sum += seconds;
}

std::string Metrics::Histogram::text(const char* name, const std::string& labels) const
{
    std::string result;
    std::uint64_t all = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        all += counts[i];
        result += fmt::format("{}_bucket{{{},le=\"{}\"}} {}\n", name, labels,
                              i < bounds_s.size() ? fmt::format("{:g}", bounds_s[i]) : "+Inf", all);
    }
    return result + fmt::format("{0}_sum{{{1}}} {2}\n{0}_count{{{1}}} {3}\n", name, labels, sum, all);
}

void Metrics::countRequest(const std::string& route, int status, double seconds)
{
    const std::lock_guard lock(mutex_);
    ++requests_[{route, status}];
    latency_[route].add(seconds);
}

void Metrics::countCache(Cache what)
{
    const std::lock_guard lock(mutex_);
    ++caches_[std::size_t(what)];
}

void Metrics::countRender(double seconds, const std::map<std::string, double>& passMs)
{
    const std::lock_guard lock(mutex_);
    ++renders_;
    renderSeconds_ += seconds;
    for (const auto& [pass, ms] : passMs) passSeconds_[pass] += 1e-3 * ms;
}

void Metrics::countOvertaken()
{
    const std::lock_guard lock(mutex_);
    ++overtaken_;
}

void Metrics::countGone()
{
    const std::lock_guard lock(mutex_);
    ++gone_;
}

void Metrics::countPrefetched()
{
    const std::lock_guard lock(mutex_);
    ++prefetched_;
}

std::string Metrics::text(const Gauges& g) const
{
    const std::lock_guard lock(mutex_);
    std::string text = head("virga_requests_total", "counter", "Requests answered, by route and HTTP status.");
    for (const auto& [what, count] : requests_)
        text += fmt::format("virga_requests_total{{route=\"{}\",status=\"{}\"}} {}\n", what.first, what.second, count);
    text += head("virga_request_seconds", "histogram", "From the whole head of a request to the end of its answer.");
    for (const auto& [route, histogram] : latency_)
        text += histogram.text("virga_request_seconds", fmt::format("route=\"{}\"", route));
    text += head("virga_cache_total", "counter",
                 "Frames asked for: unchanged (304), an answer kept, a picture kept, or rendered.");
    constexpr const char* caches[] = {"unchanged", "body", "picture", "miss"};
    for (std::size_t i = 0; i < caches_.size(); ++i)
        text += fmt::format("virga_cache_total{{result=\"{}\"}} {}\n", caches[i], caches_[i]);
    text += single("virga_renders_total", "counter", "Frames rendered.", renders_);
    text += single("virga_render_seconds_total", "counter", "Time of rendering.", renderSeconds_);
    text += head("virga_pass_seconds_total", "counter", "Time of rendering by pass.");
    for (const auto& [pass, seconds] : passSeconds_)
        text += fmt::format("virga_pass_seconds_total{{pass=\"{}\"}} {}\n", pass, seconds);
    text += single("virga_overtaken_total", "counter", "Requests that a newer one of the same viewer overtook.",
                   overtaken_);
    text += single("virga_clients_gone_total", "counter", "Requests whose client went away first.", gone_);
    text += single("virga_prefetched_total", "counter", "Frames rendered before anybody asked.", prefetched_);
    text += single("virga_queue_waiting", "gauge", "Frames that wait to be rendered.", g.waiting);
    text += single("virga_sessions", "gauge", "Sessions.", g.sessions);
    text += single("virga_connections", "gauge", "Connections, idle ones among them.", g.connections);
    text += single("virga_cached_bytes", "gauge", "Bytes of pictures and answers kept.", g.cachedBytes);
    text += single("virga_shared_bytes", "gauge", "Bytes of shared memory handed out.", g.sharedBytes);
    text += single("virga_uptime_seconds", "gauge", "Since the server started.", g.uptime_s);
    return text;
}

}  // namespace virga::server
