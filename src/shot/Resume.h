// Going on with a sequence that is rendered in part (`--resume`): each frame carries a fingerprint of all that it was
// made of, in its file's "Software" metadata, and is made anew unless it is whole and the fingerprint is what it would
// be now.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/Plate.h"
#include "shot/Settings.h"

namespace virga::shot {

class FrameFingerprints {
public:
    /// Of the version, every setting but --on-error, what of the whole plate every frame depends on (its size, rate,
    /// range, and the frames that light and grade are judged by), and the files that the settings name, by size and
    /// time of change. layers, half: of RainJobOptions.
    FrameFingerprints(const Settings& settings, const io::PlateInfo& plate, bool layers, bool half);

    /// "Virga 0.1.0, made of 0123456789abcdef": of all that and of the frame's own files.
    std::string of(FrameNumber frame) const;

private:
    std::string plate_, depth_;
    bool isPlatePattern_, isDepthPattern_;
    std::uint64_t common_;
};

/// Those of `frames` that are not there under `pattern`, whole and of that fingerprint; in their order.
std::vector<FrameNumber> framesToMake(const std::vector<FrameNumber>& frames, const std::string& pattern,
                                      const FrameFingerprints& fingerprints);

}  // namespace virga::shot
