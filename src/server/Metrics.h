// What the server counts, for /metrics: Prometheus' text format 0.0.4.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace virga::server {

/// What is known at the moment of asking.
struct Gauges {
    std::size_t sessions = 0, connections = 0, waiting = 0, cachedBytes = 0, sharedBytes = 0;
    double uptime_s = 0;
};

/// Thread-safe.
class Metrics {
public:
    /// route: "frame", "session", "page" ...; never what a client wrote, which would be a series for each.
    void countRequest(const std::string& route, int status, double seconds);
    enum class Cache { Unchanged, Body, Picture, Missed };
    void countCache(Cache what);
    void countRender(double seconds, const std::map<std::string, double>& passMs);
    void countOvertaken();
    void countGone();
    void countPrefetched();

    std::string text(const Gauges& gauges) const;

private:
    static constexpr std::array<double, 10> bounds_s = {0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 10};
    struct Histogram {
        std::array<std::uint64_t, bounds_s.size() + 1> counts{};
        double sum = 0;
        void add(double seconds);
        std::string text(const char* name, const std::string& labels) const;
    };
    mutable std::mutex mutex_;
    std::map<std::pair<std::string, int>, std::uint64_t> requests_;
    std::map<std::string, Histogram> latency_;  // by route
    std::array<std::uint64_t, 4> caches_{};
    std::uint64_t renders_ = 0, overtaken_ = 0, gone_ = 0, prefetched_ = 0;
    double renderSeconds_ = 0;
    std::map<std::string, double> passSeconds_;
};

}  // namespace virga::server
