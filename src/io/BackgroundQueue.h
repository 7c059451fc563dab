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
    static constexpr std::size_t unlimited = std::size_t(-1);

    /// push() blocks while `capacity` jobs wait, or while those that wait and run hold so much that one more would hold
    /// over `mostBytes`; a job that alone does may still be the only one.
    BackgroundQueue(int threads, std::size_t capacity, std::size_t mostBytes = unlimited);
    /// Drops the jobs that have not begun.
    ~BackgroundQueue();
    BackgroundQueue(const BackgroundQueue&) = delete;
    BackgroundQueue& operator=(const BackgroundQueue&) = delete;

    /// bytes: what the job holds until it is done.
    void push(std::function<void()> job, std::size_t bytes = 0);
    /// Waits until nothing is left to do.
    void drain();

private:
    struct Job {
        std::function<void()> run;
        std::size_t bytes = 0;
    };
    bool hasRoomFor(std::size_t bytes) const;
    void work();

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Job> jobs_;
    std::size_t capacity_, mostBytes_, running_ = 0, held_ = 0;
    std::exception_ptr problem_;
    bool stopping_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace virga::io
