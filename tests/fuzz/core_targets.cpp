#include <algorithm>
#include <set>

#include "core/FrameRange.h"
#include "core/Words.h"
#include "fuzz/Targets.h"

namespace virga::fuzz {

namespace {

/// Frames, each one once, that formatFrameRange writes so that they are read back.
void takeFrameRange(std::string_view input)
{
    if (!isOneLine(input)) return;  // what is typed is repeated as it was typed
    constexpr std::size_t limit = 1000;
    std::vector<FrameNumber> frames;
    if (!answers({ErrorCode::InvalidArgument}, [&] { frames = parseFrameRange(input, limit); })) return;
    require(!frames.empty() && frames.size() <= limit, "there are frames, no more than the limit");
    require(std::set<FrameNumber>(frames.begin(), frames.end()).size() == frames.size(), "each frame comes once");
    require(parseFrameRange(formatFrameRange(frames), limit) == frames, "what is written is read back");
}

void takeWord(std::string_view input)
{
    const std::vector<std::string> known = {"rate", "near", "depth-no-value", "output-colorspace"};
    const std::string nearest = nearestWord(input, known);
    require(nearest.empty() || std::find(known.begin(), known.end(), nearest) != known.end(), "the word is known");
}

}  // namespace

std::vector<Target> coreTargets()
{
    return {{"frame-range",
             takeFrameRange,
             {"1-10", "1-10x2", "-8--5", "10-1x-1", "1,3,5-9x2 20", "9223372036854775807--9223372036854775808x3"},
             {"-", "x", ",", "--", "9223372036854775807"}},
            {"nearest-word", takeWord, {"rat", "deph-no-value", "outputcolorspace"}, {"rate", "-", "depth"}}};
}

}  // namespace virga::fuzz
