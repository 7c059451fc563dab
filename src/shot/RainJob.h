// `virga rain`, whole: plate in, rain, plate out. Decoding, rendering and encoding overlap.
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <string>

#include "core/Timer.h"
#include "shot/Compositor.h"
#include "shot/MemoryPlan.h"
#include "shot/ReferenceRenderer.h"
#include "shot/Settings.h"

namespace virga::shot {

struct RainJobOptions {
    std::string plate, output;
    std::string frames;  ///< frame range; empty: all
    bool layers = false;
    bool half = false;     ///< EXR as half even if the plate is float
    bool resume = false;   ///< frames of a sequence that are there, whole and made of the same, stay (shot/Resume.h)
    std::string preview;   ///< contact sheet, PNG; empty: none
    std::string timeline;  ///< what each thread did when, JSON (core/Timeline.h); empty: nobody wants it
    std::string device = "auto";
    std::string shaderFolder;
    std::string cacheFolder;  ///< see CompositorOptions
    /// Told before the first frame what the job will hold; may be empty.
    std::function<void(const std::vector<MemoryUse>&)> onPlan{};
    std::optional<ReferenceOptions> reference;  ///< render by the reference instead
};

/// What is told while working.
struct Progress {
    std::size_t done = 0, total = 0;
    FrameNumber frame = 0;  ///< finished last
    double seconds = 0;     ///< since the first frame was asked for
};
enum class Verdict { Continue, Stop };

struct RainReport {
    io::PlateInfo plate;
    FramePlan plan;
    CompositorStatistics statistics;
    std::vector<FrameNumber> frames;          ///< written
    std::vector<std::string> repairedFrames;  ///< sentences: held or skipped, and why
    double seconds = 0;                       ///< from the first read to the last write
    double plannedBytes = 0;                  ///< see planMemory
    double startSeconds = 0;                  ///< from the command to the first read
    bool stopped = false;                     ///< by the user, after the frames listed
    std::size_t keptFrames = 0;               ///< by RainJobOptions::resume
    bool isStreamCopy = false;                ///< the plate's own packets, not encoded anew
    std::string copyObstacle;                 ///< why frames that nobody touches were encoded all the same; else empty
};

/// Runs the job. progress is called after each frame on this thread; Stop finishes the file so that it plays.
/// Throws Error; nothing half-written is left under the output's name.
RainReport runRainJob(const Settings& settings, const RainJobOptions& options,
                      const std::function<Verdict(const Progress&)>& progress);

/// The plan alone, without rendering: for `--explain` on its own.
std::string explain(const FramePlan& plan, const CompositorStatistics* statistics);

/// The object that `virga rain --json` prints.
std::string reportJson(const RainReport& report, const Settings& settings);

}  // namespace virga::shot
