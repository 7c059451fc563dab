#include "core/FrameRange.h"

#include <charconv>
#include <unordered_set>

#include "core/Error.h"

namespace virga {
namespace {

/// Reads a signed whole number from the front of `text`; false if there is none.
bool takeNumber(std::string_view& text, FrameNumber& number)
{
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return false;
    text.remove_prefix(std::size_t(end - text.data()));
    return true;
}

struct Run {
    FrameNumber first, last, step;

    /// Less one. Unsigned, as the numbers may lie further apart than a FrameNumber reaches.
    std::uint64_t steps() const
    {
        const std::uint64_t from = std::uint64_t(first), to = std::uint64_t(last), by = std::uint64_t(step);
        return step > 0 ? (to - from) / by : (from - to) / (0 - by);
    }
};

Run parseRun(std::string_view part, std::string_view whole)
{
    const auto fail = [&]() -> Run {
        throw Error(ErrorCode::InvalidArgument,
                    "frame range '{}': '{}' is not a frame range; write it as first-last[xstep], e.g. 1-10x2", whole,
                    part);
    };
    Run run{};
    std::string_view rest = part;
    if (!takeNumber(rest, run.first)) return fail();
    if (rest.empty()) return {run.first, run.first, 1};
    if (rest.front() != '-') return fail();
    rest.remove_prefix(1);
    if (!takeNumber(rest, run.last)) return fail();
    run.step = run.first <= run.last ? 1 : -1;
    if (!rest.empty()) {
        if (rest.front() != 'x') return fail();
        rest.remove_prefix(1);
        if (!takeNumber(rest, run.step) || !rest.empty() || run.step == 0) return fail();
        if (run.first != run.last && (run.first < run.last) != (run.step > 0)) return fail();
    }
    return run;
}

}  // namespace

std::vector<FrameNumber> parseFrameRange(std::string_view text, std::size_t limit)
{
    std::vector<FrameNumber> frames;
    std::unordered_set<FrameNumber> seen;
    std::string_view rest = text;
    while (!rest.empty()) {
        const std::size_t end = rest.find_first_of(", \t");
        const std::string_view part = rest.substr(0, end);
        rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
        if (part.empty()) continue;
        const Run run = parseRun(part, text);
        const std::uint64_t steps = run.steps();
        if (steps >= limit)
            throw Error(ErrorCode::InvalidArgument, "frame range '{}' names more than {} frames", text, limit);
        for (std::uint64_t i = 0; i <= steps; ++i) {
            const auto frame = FrameNumber(std::uint64_t(run.first) + i * std::uint64_t(run.step));
            if (!seen.insert(frame).second) continue;
            if (frames.size() == limit)
                throw Error(ErrorCode::InvalidArgument, "frame range '{}' names more than {} frames", text, limit);
            frames.push_back(frame);
        }
    }
    if (frames.empty()) throw Error(ErrorCode::InvalidArgument, "frame range '{}' names no frame", text);
    return frames;
}

std::string formatFrameRange(const std::vector<FrameNumber>& frames)
{
    std::string text;
    const auto differ = [&](std::size_t i) {  // modulo 2^64, which is as good for a test of equality
        return FrameNumber(std::uint64_t(frames[i]) - std::uint64_t(frames[i - 1]));
    };
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t end = i + 1;  // one past the run that starts at i
        const FrameNumber step = end < frames.size() ? differ(end) : 0;
        while (end < frames.size() && differ(end) == step) ++end;
        // Two lone frames read better as two, and a step that wraps around is none.
        if (end - i > 1 && ((end - i == 2 && step != 1 && step != -1) || (step > 0) != (frames[i + 1] > frames[i])))
            end = i + 1;
        if (!text.empty()) text += ',';
        text += std::to_string(frames[i]);
        if (end - i > 1) {
            text += '-' + std::to_string(frames[end - 1]);
            if (step != 1 && step != -1) text += 'x' + std::to_string(step);
        }
        i = end;
    }
    return text;
}

}  // namespace virga
