#include "RenderThread.h"

#include <exception>
#include <utility>

namespace virga {

RenderThread::RenderThread() : thread_([this] { serve(); }) {}

RenderThread::~RenderThread()
{
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void RenderThread::run(const std::function<void()>& work)
{
    std::unique_lock lock(mutex_);
    work_ = &work;
    changed_.notify_all();
    changed_.wait(lock, [&] { return work_ == nullptr; });
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void RenderThread::serve()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return work_ != nullptr || ends_; });
        if (work_ == nullptr) return;
        const std::function<void()>& work = *work_;
        lock.unlock();
        std::exception_ptr error;
        try {
            work();
        } catch (...) {
            error = std::current_exception();
        }
        lock.lock();
        error_ = error;
        work_ = nullptr;
        changed_.notify_all();
    }
}

}  // namespace virga
