#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace virga::io {

/// Jobs done on other threads: in the order given if there is one thread, in any order else. The first exception of a
/// job is kept, later jobs are dropped, and the next push() or drain() throws it.
class BackgroundQueue {
public:
    /// `capacity`: jobs that may wait before push() blocks.
    BackgroundQueue(int threads, std::size_t capacity);
    /// Drops the jobs that have not begun.
    ~BackgroundQueue();
    BackgroundQueue(const BackgroundQueue&) = delete;
    BackgroundQueue& operator=(const BackgroundQueue&) = delete;

    void push(std::function<void()> job);
    /// Waits until nothing is left to do.
    void drain();

private:
    void work();

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> jobs_;
    std::size_t capacity_, running_ = 0;
    std::exception_ptr problem_;
    bool stopping_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace virga::io
