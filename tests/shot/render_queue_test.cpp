// The queue of the thread that renders for everybody.
#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/Error.h"
#include "shot/RenderQueue.h"

namespace virga::shot {
namespace {

/// Holds the queue's thread until it is opened.
class Gate {
public:
    void pass()
    {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return isOpen_; });
    }
    void open()
    {
        {
            const std::lock_guard lock(mutex_);
            isOpen_ = true;
        }
        changed_.notify_all();
    }

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool isOpen_ = false;
};

ErrorCode codeOf(const RenderQueue::Ticket& ticket)
{
    try {
        ticket.wait();
    } catch (const Error& error) {
        return error.code();
    }
    ADD_FAILURE() << "nothing was thrown";
    return ErrorCode::Internal;
}

TEST(RenderQueue, WhatIsGivenUpNeitherCountsNorKeepsWhatItWasToWorkOn)
{
    RenderQueue queue;
    Gate first, second;
    auto held = std::make_shared<int>(1);
    const std::weak_ptr<int> isHeld = held;
    std::atomic<bool> hasBegun = false;
    queue.submit(9, [&](const auto&) { first.pass(); });
    RenderQueue::Ticket least = queue.submit(-1000, [held](const auto&) {});
    const RenderQueue::Ticket busy = queue.submit(5, [&](const auto&) {
        hasBegun = true;
        second.pass();
    });
    held.reset();
    while (queue.waiting() > 2) std::this_thread::yield();  // the first has begun
    least.cancel();
    EXPECT_EQ(queue.waiting(), 1u);
    first.open();
    while (!hasBegun) std::this_thread::yield();
    EXPECT_TRUE(isHeld.expired());  // though more important work never ends
    second.open();
    busy.wait();
}

TEST(RenderQueue, WorksByPriorityThenInOrder)
{
    RenderQueue queue;
    Gate gate;
    std::string order;
    queue.submit(9, [&](const auto&) { gate.pass(); });
    std::vector<RenderQueue::Ticket> tickets;
    for (const auto& [priority, name] : {std::pair(0, 'c'), std::pair(1, 'a'), std::pair(0, 'd'), std::pair(1, 'b')})
        tickets.push_back(queue.submit(priority, [&order, letter = name](const auto&) { order += letter; }));
    gate.open();
    for (const auto& ticket : tickets) ticket.wait();
    EXPECT_EQ(order, "abcd");
}

// Whoever waits for work that was given up need not wait for what runs.
TEST(RenderQueue, WorkThatIsGivenUpIsDoneAtOnce)
{
    RenderQueue queue;
    Gate gate;
    const auto runs = queue.submit(0, [&](const auto&) { gate.pass(); });
    bool hasRun = false;
    auto waits = queue.submit(0, [&](const auto&) { hasRun = true; });
    waits.cancel();
    EXPECT_EQ(codeOf(waits), ErrorCode::Interrupted);
    EXPECT_FALSE(runs.isDone());
    gate.open();
    queue.submit(0, [](const auto&) {}).wait();
    EXPECT_FALSE(hasRun);
}

TEST(RenderQueue, WorkThatRunsMayLookWhetherItIsWanted)
{
    RenderQueue queue;
    Gate begun, goesOn;
    auto ticket = queue.submit(0, [&](const RenderQueue::Ticket& self) {
        begun.open();
        goesOn.pass();
        if (self.isCancelled()) throw Error(ErrorCode::Interrupted, "ended early");
    });
    begun.pass();
    ticket.cancel();
    goesOn.open();
    EXPECT_EQ(codeOf(ticket), ErrorCode::Interrupted);
    ticket.cancel();  // and once more
    EXPECT_TRUE(ticket.isDone());
}

TEST(RenderQueue, HandsOnWhatIsThrownAndGoesOn)
{
    RenderQueue queue;
    EXPECT_EQ(codeOf(queue.submit(0, [](const auto&) { throw Error(ErrorCode::Input, "no plate"); })),
              ErrorCode::Input);
    std::thread::id inside;
    queue.run([&] { queue.run([&] { inside = std::this_thread::get_id(); }); });
    EXPECT_NE(inside, std::thread::id());
    EXPECT_NE(inside, std::this_thread::get_id());
}

TEST(RenderQueue, GivesUpWhatWaitsWhenItEnds)
{
    Gate gate;
    RenderQueue::Ticket waits;
    std::thread opener;
    {
        RenderQueue queue;
        queue.submit(0, [&](const auto&) { gate.pass(); });
        waits = queue.submit(0, [](const auto&) { ADD_FAILURE() << "began"; });
        opener = std::thread([&] {
            EXPECT_EQ(codeOf(waits), ErrorCode::Interrupted);
            gate.open();
        });
    }
    opener.join();
}

TEST(RenderQueue, ServesManyThreads)
{
    RenderQueue queue;
    std::atomic<int> done = 0, givenUp = 0;
    int inside = 0;  // of the queue's thread alone
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < 200; ++i) {
                auto ticket = queue.submit(i % 3, [&](const auto&) { ++inside; });
                if ((i + t) % 5 == 0) ticket.cancel();
                try {
                    ticket.wait();
                    ++done;
                } catch (const Error&) {
                    ++givenUp;
                }
            }
        });
    for (std::thread& thread : threads) thread.join();
    queue.run([] {});
    EXPECT_EQ(done + givenUp, 800);
    EXPECT_LE(done, inside);
}

}  // namespace
}  // namespace virga::shot
