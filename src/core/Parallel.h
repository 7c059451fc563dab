// Loops over all cores. Thin over oneTBB, so that floors above name no thread library.
#pragma once

#include <cstddef>
#include <functional>

namespace virga {

/// Calls body(first, last) for pieces that cover [begin, end). Pieces run in any order on any thread; results must not
/// depend on how the range is cut. `grain`: the least worth handing to another thread. The first exception is rethrown.
void parallelFor(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t grain,
                 const std::function<void(std::ptrdiff_t first, std::ptrdiff_t last)>& body);

/// Both, on two threads where there are two. An exception of either is rethrown when both are done.
void together(const std::function<void()>& one, const std::function<void()>& other);

/// At most `threads` threads (>= 1; 0 = all cores) run parallelFor bodies while this object lives.
class ThreadLimit {
public:
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

private:
    void* control_;  // tbb::global_control, kept out of this header
};

}  // namespace virga
