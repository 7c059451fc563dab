#include "shot/RenderQueue.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <utility>

#include "core/Error.h"
#include "core/KeptInMemory.h"
#include "gl/SharedContexts.h"

namespace virga::shot {

struct RenderQueue::Ticket::State {
    int priority = 0;
    std::uint64_t number = 0;
    Work work;
    std::atomic<bool> cancelled = false;

    mutable std::mutex mutex;
    mutable std::condition_variable changed;
    bool hasBegun = false, isDone = false;
    std::exception_ptr error;

    /// False if it was given up before.
    bool begin()
    {
        const std::lock_guard lock(mutex);
        return hasBegun = !isDone;
    }
    void finish(std::exception_ptr why)
    {
        {
            const std::lock_guard lock(mutex);
            error = std::move(why);
            isDone = true;
        }
        changed.notify_all();
    }
    void giveUp()
    {
        cancelled = true;
        {
            const std::lock_guard lock(mutex);
            if (hasBegun || isDone) return;
            error = std::make_exception_ptr(Error(ErrorCode::Interrupted, "the frame is wanted no longer"));
            isDone = true;
        }
        changed.notify_all();
    }
};

void RenderQueue::Ticket::cancel() noexcept
try {
    state_->giveUp();
} catch (...) {  // no memory for the sentence: it stays cancelled, and is given up when its turn comes
}
bool RenderQueue::Ticket::isCancelled() const noexcept { return state_->cancelled; }

bool RenderQueue::Ticket::isDone() const noexcept
{
    const std::lock_guard lock(state_->mutex);
    return state_->isDone;
}

void RenderQueue::Ticket::wait() const
{
    std::unique_lock lock(state_->mutex);
    state_->changed.wait(lock, [&] { return state_->isDone; });
    if (state_->error) std::rethrow_exception(state_->error);
}

bool RenderQueue::Order::operator()(const std::shared_ptr<Ticket::State>& a,
                                    const std::shared_ptr<Ticket::State>& b) const
{
    return a->priority != b->priority ? a->priority > b->priority : a->number < b->number;
}

RenderQueue::RenderQueue() : thread_([this] { serve(); }) {}

RenderQueue::~RenderQueue()
{
    {
        const std::lock_guard lock(mutex_);
        ends_ = true;
        for (const auto& state : waiting_) state->giveUp();
    }
    changed_.notify_all();
    thread_.join();
}

std::shared_ptr<RenderQueue> RenderQueue::ofProcess()
{
    static std::mutex mutex;
    static std::weak_ptr<RenderQueue> ofAll;
    const std::lock_guard lock(mutex);
    auto queue = ofAll.lock();
    if (!queue) ofAll = queue = std::make_shared<RenderQueue>();
    return queue;
}

RenderQueue::Ticket RenderQueue::submit(int priority, Work work)
{
    Ticket ticket;
    ticket.state_ = std::make_shared<Ticket::State>();
    ticket.state_->priority = priority;
    ticket.state_->work = std::move(work);
    {
        const std::lock_guard lock(mutex_);
        ticket.state_->number = count_++;
        waiting_.insert(ticket.state_);
    }
    changed_.notify_all();
    return ticket;
}

void RenderQueue::run(const std::function<void()>& work)
{
    if (std::this_thread::get_id() == thread_.get_id()) return work();
    submit(std::numeric_limits<int>::max(), [&](const Ticket&) { work(); }).wait();
}

std::size_t RenderQueue::waiting() const
{
    const std::lock_guard lock(mutex_);
    return std::size_t(std::count_if(waiting_.begin(), waiting_.end(), [](const auto& s) { return !s->cancelled; }));
}

void RenderQueue::serve()
{
    const KeptInMemory kept;
    const gl::SharedContexts contexts;
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return !waiting_.empty() || ends_; });
        if (waiting_.empty()) return;
        Ticket ticket;
        // What was given up goes first: it costs nothing, holds what it was to work on, and its own turn might never
        // come.
        const auto givenUp =
            std::find_if(waiting_.begin(), waiting_.end(), [](const auto& s) { return s->cancelled.load(); });
        const auto next = givenUp != waiting_.end() ? givenUp : waiting_.begin();
        ticket.state_ = *next;
        waiting_.erase(next);
        lock.unlock();
        const bool begins = ticket.state_->begin();
        std::exception_ptr error;
        try {
            if (begins && ticket.isCancelled()) throw Error(ErrorCode::Interrupted, "the frame is wanted no longer");
            if (begins) ticket.state_->work(ticket);
        } catch (...) {
            error = std::current_exception();
        }
        ticket.state_->work = nullptr;  // what it holds goes on the thread that it was for
        if (begins) ticket.state_->finish(std::move(error));
        lock.lock();
    }
}

}  // namespace virga::shot
