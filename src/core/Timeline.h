// What each thread did and when, for people: events in Chrome's trace-event format, which Perfetto and chrome://tracing
// open. One lane a thread, one event a stage a frame; the events of a lane lie beside or inside one another.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/FrameRange.h"

namespace virga {

/// Any thread may add events. Names are words of ours: they are written as they are.
class Timeline {
public:
    using Clock = std::chrono::steady_clock;

    /// What this thread's lane is called, whatever its first event says.
    void nameThread(const char* lane);
    /// lane: what this thread is called if this is its first event. stage: literal.
    void add(const char* lane, const char* stage, FrameNumber frame, Clock::time_point start, Clock::time_point end);
    /// On a lane that is no thread's, such as a device's.
    void addApart(const char* lane, const char* stage, FrameNumber frame, Clock::time_point start,
                  Clock::time_point end);

    /// {"traceEvents": [...]}, times in microseconds from the making of this object; events in the order of starting.
    std::string json() const;

private:
    struct Lane {
        std::string name;
        int number;
    };
    struct Event {
        int lane;
        const char* stage;
        FrameNumber frame;
        double start_us, duration_us;
    };
    Lane& laneFor(const std::string& name);
    void add(int lane, const char* stage, FrameNumber frame, Clock::time_point start, Clock::time_point end);

    const Clock::time_point begin_ = Clock::now();
    mutable std::mutex mutex_;
    std::vector<Lane> lanes_;
    std::map<std::thread::id, int> ofThread_;
    std::vector<Event> events_;
};

/// An event from its construction to its end; nothing without a timeline.
class StageSpan {
public:
    StageSpan(Timeline* timeline, const char* lane, const char* stage, FrameNumber frame)
        : timeline_(timeline), lane_(lane), stage_(stage), frame_(frame)
    {
        if (timeline_ != nullptr) start_ = Timeline::Clock::now();
    }
    ~StageSpan() { end(); }
    StageSpan(const StageSpan&) = delete;
    StageSpan& operator=(const StageSpan&) = delete;

private:
    void end() noexcept;

    Timeline* timeline_;
    const char *lane_, *stage_;
    FrameNumber frame_;
    Timeline::Clock::time_point start_{};
};

}  // namespace virga
