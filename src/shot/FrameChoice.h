// Which of a plate's frames are worked on.
#pragma once

#include <string>
#include <vector>

#include "io/Plate.h"

namespace virga::shot {

/// "frame 7 is", "frames 7-9 are".
std::string describeFrames(const std::vector<FrameNumber>& frames, const char* one, const char* several);

/// The frames that `range` names, in its order; all from the first to the last if it is empty. Frames that a sequence
/// lacks stop the work (OnError::Stop), or stay in the list for the reader, which leaves them out (Skip) or finds
/// another in their place (Hold). A still stands in for every frame. Throws Error(Input) listing the frames that are
/// missing from a sequence, Error(InvalidArgument) for frames that a movie does not have or a range that cannot be
/// read.
std::vector<FrameNumber> chooseFrames(const std::string& range, const io::PlateInfo& plate, io::OnError onError);

}  // namespace virga::shot
