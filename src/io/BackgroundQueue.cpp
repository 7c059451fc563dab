#include "io/BackgroundQueue.h"

#include <utility>

namespace virga::io {

BackgroundQueue::BackgroundQueue(int threads, std::size_t capacity) : capacity_(capacity)
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

void BackgroundQueue::push(std::function<void()> job)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return problem_ || jobs_.size() < capacity_; });
    if (problem_) std::rethrow_exception(problem_);
    jobs_.push_back(std::move(job));
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
        std::function<void()> job = std::move(jobs_.front());
        jobs_.pop_front();
        ++running_;
        changed_.notify_all();
        lock.unlock();
        std::exception_ptr problem;
        try {
            job();
        } catch (...) {
            problem = std::current_exception();
        }
        job = nullptr;  // what it holds is freed without the lock
        lock.lock();
        --running_;
        if (problem && !problem_) {
            problem_ = problem;
            jobs_.clear();
        }
        changed_.notify_all();
    }
}

}  // namespace virga::io
