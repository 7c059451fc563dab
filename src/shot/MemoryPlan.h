// What a job will hold, before it begins: bounded by the picture's size, whatever the length of the clip.
#pragma once

#include <string>
#include <vector>

#include "io/Plate.h"
#include "shot/FramePlan.h"

namespace virga::shot {

/// Something that is held at once, at most.
struct MemoryUse {
    std::string what;
    double bytes = 0;
};

/// What the plan does not say.
struct MemoryDemand {
    std::size_t frames = 1;       ///< of the job
    double strokes = 0;           ///< expected in a frame
    bool isDepthAnImage = false;  ///< which is read and repaired; else a plane, if there is depth
    bool writesSequence = false;  ///< on several threads
    bool writesHalf = false;
    bool byShaders = false;  ///< textures and buffers; on a device of its own they are in its memory
};

/// Frames read ahead, the one in work, those to be written, the renderer's buffers, and the program itself with its
/// libraries. The peak that comes about is within a third of the sum for plates of a megapixel and more
/// (tests/cli/memory_test.py): pages that nobody touches are not there, and allocators keep some that nobody needs.
std::vector<MemoryUse> planMemory(const FramePlan& plan, const io::PlateInfo& plate, const MemoryDemand& demand);

double totalBytes(const std::vector<MemoryUse>& uses);

/// "about 1.7 GB: 2 frames read ahead 1.1 GB, ...".
std::string memoryWords(const std::vector<MemoryUse>& uses);

}  // namespace virga::shot
