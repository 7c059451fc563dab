// What a rain job reads and writes, out of its settings, and what is refused before there is work to lose.
#pragma once

#include <vector>

#include "io/Plate.h"
#include "shot/FramePlan.h"
#include "shot/RainJob.h"

namespace virga::shot {

io::OnError onErrorOf(const Settings& settings);
/// Throws Error(InvalidArgument) for a frame or stream that is no whole number.
io::ReadOptions readOptionsOf(const Settings& settings, io::OnError onError);
io::WriteOptions writeOptionsOf(const Settings& settings, const RainJobOptions& options);

/// Throws Error(Input) listing frames of a depth sequence that are missing, unless they are skipped or held.
void checkDepthFrames(const Settings& settings, const FramePlan& plan, const std::vector<FrameNumber>& frames,
                      io::OnError onError);

/// No result takes the place of what the rain is made from. (The plate itself: createPlateWriter.) Throws
/// Error(Output).
void refuseWritingOverInputs(const Settings& settings, const RainJobOptions& options,
                             const std::vector<FrameNumber>& frames);

/// The contact sheet's name. Throws Error(Output).
void checkPreview(const RainJobOptions& options);
/// The timeline's. Throws Error(Output).
void checkTimeline(const RainJobOptions& options);

}  // namespace virga::shot
