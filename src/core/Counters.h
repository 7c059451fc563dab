// What the process has done since it began, for tests, benchmarks and monitors. Nothing is decided by it.
#pragma once

#include <atomic>
#include <cstdint>

namespace virga {

struct Counters {
    std::atomic<std::uint64_t> frames = 0;    ///< drawn for callers of the library
    std::atomic<std::uint64_t> contexts = 0;  ///< of OpenGL, opened
    std::atomic<std::uint64_t> programs = 0;  ///< compiled from text, or taken from a binary that was kept in a file
    std::atomic<std::uint64_t> environments = 0;  ///< panoramas, given or made from plates, whose light was worked out
};

Counters& counters() noexcept;

}  // namespace virga
