#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "io/BackgroundQueue.h"

namespace virga::io {
namespace {

// What waits and runs never holds more than it may, unless one job alone does; and everything is done.
TEST(BackgroundQueue, HoldsNoMoreThanItMay)
{
    for (const std::size_t each : {std::size_t(10), std::size_t(40), std::size_t(1000)}) {
        std::atomic<std::size_t> held = 0, most = 0, done = 0;
        BackgroundQueue queue(4, 8, 100);
        for (int i = 0; i < 50; ++i) {
            queue.push(
                [&] {
                    std::this_thread::sleep_for(std::chrono::microseconds(200));
                    held -= each;
                    ++done;
                },
                each);
            // Counted after it was let in: what is done meanwhile only makes it less.
            most = std::max(most.load(), held += each);
        }
        queue.drain();
        EXPECT_EQ(done, 50u);
        EXPECT_LE(most, std::max<std::size_t>(100, each));
        EXPECT_GE(most, each);
    }
}

TEST(BackgroundQueue, ForgetsWhatDroppedJobsHeld)
{
    BackgroundQueue queue(1, 8, 100);
    queue.push([] { throw std::runtime_error("first"); }, 60);
    try {
        for (int i = 0; i < 4; ++i) queue.push([] {}, 60);
        queue.drain();
        FAIL() << "the exception is lost";
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "first");
    }
}

}  // namespace
}  // namespace virga::io
