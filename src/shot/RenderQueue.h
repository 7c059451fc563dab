// The one thread that renders for everybody in the process who asks for frames as they come (the library, the frame
// server), and the order in which they get them. A frame uses all cores or the GPU, so that two at a time would only
// both be late; and a GL context belongs to one thread, on which all that render share it, with compiled programs and
// the light of panoramas, as long as the queue lives (gl/SharedContexts.h, core/KeptInMemory.h).
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace virga::shot {

class RenderQueue {
public:
    /// Work that was handed in: whoever holds it may wait for it, hurry it or give it up. Thread-safe.
    class Ticket {
    public:
        /// If it has not begun it never will, and is done; if it has, it may look at isCancelled() and end early.
        void cancel() noexcept;
        bool isCancelled() const noexcept;
        bool isDone() const noexcept;
        /// Until it is done or given up. Rethrows what it threw; Error(Interrupted) if it never began.
        void wait() const;

    private:
        friend class RenderQueue;
        struct State;
        std::shared_ptr<State> state_;
    };
    using Work = std::function<void(const Ticket&)>;

    RenderQueue();
    /// Gives up what has not begun and waits for what has.
    ~RenderQueue();
    RenderQueue(const RenderQueue&) = delete;
    RenderQueue& operator=(const RenderQueue&) = delete;

    /// Of the process; it lives while somebody holds it.
    static std::shared_ptr<RenderQueue> ofProcess();

    /// Greater priorities first, among equals who came first.
    Ticket submit(int priority, Work work);
    /// Before everything else, and waits. From the queue's own thread: at once. Rethrows.
    void run(const std::function<void()>& work);

    std::size_t waiting() const;  ///< work that has not begun and is not given up

private:
    struct Order {
        bool operator()(const std::shared_ptr<Ticket::State>& a, const std::shared_ptr<Ticket::State>& b) const;
    };
    void serve();

    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::set<std::shared_ptr<Ticket::State>, Order> waiting_;
    std::uint64_t count_ = 0;
    bool ends_ = false;
    std::thread thread_;  // last: it starts when all of the above stands
};

}  // namespace virga::shot
