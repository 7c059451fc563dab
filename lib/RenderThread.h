#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace virga {

/// One thread that runs what it is given while the caller waits. A GL context belongs to the thread that made it
/// (gl/Context.h), and the host's own context must stay current on the host's.
class RenderThread {
public:
    RenderThread();
    ~RenderThread();
    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;

    /// Runs `work` on the thread and returns when it is done; rethrows what it threw. One caller at a time.
    void run(const std::function<void()>& work);

private:
    void serve();

    std::mutex mutex_;
    std::condition_variable changed_;
    const std::function<void()>* work_ = nullptr;
    std::exception_ptr error_;
    bool ends_ = false;
    std::thread thread_;  // last: it starts when all of the above stands
};

}  // namespace virga
