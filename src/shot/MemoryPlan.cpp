#include "shot/MemoryPlan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

namespace virga::shot {
namespace {

constexpr double ofProgram = 130e6;  // with its libraries, measured on a picture of 96x54
constexpr double rgba = 16;          // bytes a pixel

/// Sums for each pixel, as passes::FrameTargets and the processor's bands keep them.
double sumsPerPixel(const passes::Features& f) { return 1 + (f.fog ? 1 : 0) + (f.lights ? 3 : 0); }

/// What one frame has for a writer: the beauty and, with layers, four more, depth and motion.
double bytesToWrite(const passes::Features& f, double pixels)
{
    return pixels * (rgba * (f.layers ? 5 : 1) + (f.nearest ? 12 : 0));
}

double rendererBytes(const passes::Features& f, const MemoryDemand& demand, double pixels)
{
    double bytes = f.depth ? pixels * 4 : 0;
    bytes += f.blur ? pixels * 2 * rgba : 0;
    bytes += demand.strokes * (f.lights ? 64 : 52);
    if (!demand.byShaders) return bytes;  // sums are a band's, and pictures are drawn over where they lie
    bytes += pixels * 2 * rgba + pixels * 4 * sumsPerPixel(f) * ((f.rain ? 1 : 0) + (f.splashes ? 1 : 0));
    return bytes + (f.layers ? pixels * 4 * rgba : 0) + (f.nearest ? pixels * 8 : 0);
}

std::string sizeWords(double bytes)
{
    return bytes < 1e9 ? fmt::format("{:.0f} MB", bytes * 1e-6) : fmt::format("{:.1f} GB", bytes * 1e-9);
}

}  // namespace

std::vector<MemoryUse> planMemory(const FramePlan& plan, const io::PlateInfo& plate, const MemoryDemand& demand)
{
    const passes::Features& f = plan.features;
    const double pixels = double(plate.width) * plate.height;
    const auto ahead = double(std::min(demand.frames, io::framesReadAhead(plate)));
    std::vector<MemoryUse> uses = {{"program", ofProgram}};
    if (demand.frames > 1) uses.push_back({fmt::format("{:.0f} frames ahead", ahead), ahead * pixels * rgba});
    uses.push_back({"frame in work", bytesToWrite(f, pixels)});

    // One waits to be taken on while as many as there are threads are written; see io::BackgroundQueue.
    const double threads = demand.writesSequence ? std::clamp(std::thread::hardware_concurrency(), 1u, 8u) : 1;
    const double one = bytesToWrite(f, pixels);
    const double most = std::max(one, double(io::mostBytesToWrite));
    // One that is larger than all that may wait is written before the next is begun.
    const bool isAlone = demand.writesSequence && one > double(io::mostBytesToWrite);
    const double waiting = isAlone ? 0 : std::min({double(demand.frames), threads + 2, std::floor(most / one)});
    if (!isAlone) uses.push_back({fmt::format("{:.0f} to write", waiting), waiting * one});
    if (demand.writesHalf) {
        const double rows = std::min(1.0, 256.0 / plate.height);  // of a file, packed at a time
        uses.push_back({"as half", std::clamp(waiting, 1.0, threads) * rows * one / 2});
    }
    if (demand.isDepthAnImage && f.depth) uses.push_back({"depth as read", pixels * 4 * 2});
    if (!plan.isPassThrough()) uses.push_back({"renderer", rendererBytes(f, demand, pixels)});
    return uses;
}

double totalBytes(const std::vector<MemoryUse>& uses)
{
    double bytes = 0;
    for (const MemoryUse& use : uses) bytes += use.bytes;
    return bytes;
}

std::string memoryWords(const std::vector<MemoryUse>& uses)
{
    std::string words;
    for (const MemoryUse& use : uses)
        words += fmt::format("{}{} {}", words.empty() ? "" : ", ", use.what, sizeWords(use.bytes));
    return fmt::format("about {}: {}", sizeWords(totalBytes(uses)), words);
}

}  // namespace virga::shot
