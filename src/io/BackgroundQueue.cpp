#include "io/BackgroundQueue.h"

#include <algorithm>
#include <utility>

namespace virga::io {

BackgroundQueue::BackgroundQueue(int threads, std::size_t capacity, std::size_t mostBytes)
    : capacity_(capacity), mostBytes_(mostBytes)
{
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

BackgroundQueue::~BackgroundQueue()
{
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
        jobs_.clear();
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

bool BackgroundQueue::hasRoomFor(std::size_t bytes) const
{
    return jobs_.size() < capacity_ && (held_ == 0 || bytes <= mostBytes_ - std::min(held_, mostBytes_));
}

void BackgroundQueue::push(std::function<void()> job, std::size_t bytes)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return problem_ || hasRoomFor(bytes); });
    if (problem_) std::rethrow_exception(problem_);
    jobs_.push_back({std::move(job), bytes});
    held_ += bytes;
    changed_.notify_all();
}

void BackgroundQueue::drain()
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return jobs_.empty() && running_ == 0; });
    if (problem_) std::rethrow_exception(problem_);
}

void BackgroundQueue::work()
{
    std::unique_lock lock(mutex_);
    for (;;) {
        changed_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
        if (stopping_) return;
        Job job = std::move(jobs_.front());
        jobs_.pop_front();
        ++running_;
        changed_.notify_all();
        lock.unlock();
        std::exception_ptr problem;
        try {
            job.run();
        } catch (...) {
            problem = std::current_exception();
        }
        job.run = nullptr;  // what it holds is freed without the lock
        lock.lock();
        --running_;
        held_ -= job.bytes;
        if (problem && !problem_) {
            problem_ = problem;
            for (const Job& dropped : jobs_) held_ -= dropped.bytes;
            jobs_.clear();
        }
        changed_.notify_all();
    }
}

}  // namespace virga::io
