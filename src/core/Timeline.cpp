#include "core/Timeline.h"

#include <fmt/format.h>

#include <algorithm>

namespace virga {
namespace {

double microseconds(Timeline::Clock::duration time) { return std::chrono::duration<double, std::micro>(time).count(); }

}  // namespace

/// A new lane; of the same name there may be several, which are numbered.
Timeline::Lane& Timeline::laneFor(const std::string& name)
{
    const auto alike = std::count_if(lanes_.begin(), lanes_.end(), [&](const Lane& lane) {
        return lane.name == name || lane.name.starts_with(name + " ");
    });
    const int number = int(lanes_.size()) + 1;
    return lanes_.emplace_back(Lane{alike == 0 ? name : fmt::format("{} {}", name, alike + 1), number});
}

void Timeline::add(int lane, const char* stage, FrameNumber frame, Clock::time_point start, Clock::time_point end)
{
    events_.push_back({lane, stage, frame, microseconds(start - begin_), microseconds(end - start)});
}

void Timeline::nameThread(const char* lane)
{
    const std::lock_guard lock(mutex_);
    const auto [found, isNew] = ofThread_.try_emplace(std::this_thread::get_id(), 0);
    if (isNew) found->second = laneFor(lane).number;
}

void Timeline::add(const char* lane, const char* stage, FrameNumber frame, Clock::time_point start,
                   Clock::time_point end)
{
    const std::lock_guard lock(mutex_);
    const auto [found, isNew] = ofThread_.try_emplace(std::this_thread::get_id(), 0);
    if (isNew) found->second = laneFor(lane).number;
    add(found->second, stage, frame, start, end);
}

void Timeline::addApart(const char* lane, const char* stage, FrameNumber frame, Clock::time_point start,
                        Clock::time_point end)
{
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(lanes_.begin(), lanes_.end(), [&](const Lane& l) { return l.name == lane; });
    add(found != lanes_.end() ? found->number : laneFor(lane).number, stage, frame, start, end);
}

std::string Timeline::json() const
{
    const std::lock_guard lock(mutex_);
    std::vector<Event> events = events_;
    // Of two that start together the longer one is around the other.
    std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
        return a.start_us != b.start_us ? a.start_us < b.start_us : a.duration_us > b.duration_us;
    });
    std::string text = "{\"displayTimeUnit\": \"ms\", \"traceEvents\": [";
    const char* between = "\n";
    for (const Lane& lane : lanes_) {
        text += fmt::format(
            "{}{{\"ph\": \"M\", \"name\": \"thread_name\", \"pid\": 1, \"tid\": {}, \"args\": {{\"name\": \"{}\"}}}}",
            between, lane.number, lane.name);
        between = ",\n";
    }
    for (const Event& e : events) {
        text += fmt::format(
            "{}{{\"ph\": \"X\", \"name\": \"{}\", \"pid\": 1, \"tid\": {}, \"ts\": {:.1f}, \"dur\": {:.1f}, "
            "\"args\": {{\"frame\": {}}}}}",
            between, e.stage, e.lane, e.start_us, e.duration_us, e.frame);
        between = ",\n";
    }
    return text + "\n]}\n";
}

void StageSpan::end() noexcept
{
    if (timeline_ == nullptr) return;
    try {
        timeline_->add(lane_, stage_, frame_, start_, Timeline::Clock::now());
    } catch (...) {  // an event that is lost is better than a movie that is
    }
}

}  // namespace virga
