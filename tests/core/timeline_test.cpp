#include "core/Timeline.h"

#include <gtest/gtest.h>

#include <barrier>
#include <thread>

namespace virga {
namespace {

std::size_t countOf(const std::string& text, const std::string& word)
{
    std::size_t count = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
    return count;
}

TEST(Timeline, HasALaneAThreadAndAnEventASpan)
{
    Timeline timeline;
    timeline.nameThread("renderer");
    {
        const StageSpan outer(&timeline, "not its name", "render", 7);
        const StageSpan inner(&timeline, "", "draw", 7);
    }
    std::barrier together(2);  // a thread that has ended may hand its lane on
    const auto write = [&] {
        const StageSpan span(&timeline, "writer", "write", -3);
        together.arrive_and_wait();
    };
    std::thread one(write), other(write);
    one.join();
    other.join();
    const auto now = Timeline::Clock::now();
    timeline.addApart("passes", "light", 7, now, now);
    timeline.addApart("passes", "strokes", 7, now, now + std::chrono::milliseconds(2));
    const std::string json = timeline.json();
    EXPECT_EQ(countOf(json, "thread_name"), 4u) << json;
    for (const char* lane : {"\"renderer\"", "\"writer\"", "\"writer 2\"", "\"passes\""})
        EXPECT_EQ(countOf(json, lane), 1u) << lane;
    EXPECT_EQ(countOf(json, "\"ph\": \"X\""), 6u);
    EXPECT_EQ(countOf(json, "\"frame\": -3"), 2u);
    EXPECT_EQ(countOf(json, "\"dur\": 2000.0"), 1u);
    EXPECT_LT(json.find("\"render\""), json.find("\"draw\""));  // what is around comes first
    EXPECT_EQ(json.find("not its name"), std::string::npos);
}

TEST(Timeline, NobodyWantsNone)
{
    const StageSpan span(nullptr, "renderer", "render", 1);
    EXPECT_EQ(countOf(Timeline().json(), "\"ph\""), 0u);
}

}  // namespace
}  // namespace virga
