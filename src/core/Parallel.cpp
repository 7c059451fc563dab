#include "core/Parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <exception>
#include <thread>

namespace virga {

// The thread sanitizer does not see what oneTBB, which is not built with it, does to order its threads: there the same
// is done with threads of our own (scripts/sanitize_threads.sh).

void parallelFor(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t grain,
                 const std::function<void(std::ptrdiff_t, std::ptrdiff_t)>& body)
{
    if (end - begin <= grain) {
        if (begin < end) body(begin, end);
        return;
    }
#ifdef __SANITIZE_THREAD__
    const std::ptrdiff_t middle = begin + (end - begin) / 2;
    together([&] { parallelFor(begin, middle, std::max(grain, (end - begin) / 4), body); },
             [&] { parallelFor(middle, end, std::max(grain, (end - begin) / 4), body); });
#else
    tbb::parallel_for(tbb::blocked_range<std::ptrdiff_t>(begin, end, std::size_t(grain)),
                      [&](const auto& piece) { body(piece.begin(), piece.end()); });
#endif
}

void together(const std::function<void()>& one, const std::function<void()>& other)
{
#ifdef __SANITIZE_THREAD__
    std::exception_ptr problem;
    std::thread thread([&] {
        try {
            other();
        } catch (...) {
            problem = std::current_exception();
        }
    });
    try {
        one();
    } catch (...) {
        thread.join();
        throw;
    }
    thread.join();
    if (problem) std::rethrow_exception(problem);
#else
    tbb::parallel_invoke(one, other);
#endif
}

ThreadLimit::ThreadLimit(int threads)
    : control_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                       threads > 0 ? std::size_t(threads) : std::thread::hardware_concurrency()))
{
}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

}  // namespace virga
