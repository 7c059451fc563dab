#include "core/Parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <thread>

namespace virga {

void parallelFor(std::ptrdiff_t begin, std::ptrdiff_t end, std::ptrdiff_t grain,
                 const std::function<void(std::ptrdiff_t, std::ptrdiff_t)>& body)
{
    if (end - begin <= grain) {
        if (begin < end) body(begin, end);
        return;
    }
    tbb::parallel_for(tbb::blocked_range<std::ptrdiff_t>(begin, end, std::size_t(grain)),
                      [&](const auto& piece) { body(piece.begin(), piece.end()); });
}

void together(const std::function<void()>& one, const std::function<void()>& other)
{
    tbb::parallel_invoke(one, other);
}

ThreadLimit::ThreadLimit(int threads)
    : control_(new tbb::global_control(tbb::global_control::max_allowed_parallelism,
                                       threads > 0 ? std::size_t(threads) : std::thread::hardware_concurrency()))
{
}

ThreadLimit::~ThreadLimit() { delete static_cast<tbb::global_control*>(control_); }

}  // namespace virga
