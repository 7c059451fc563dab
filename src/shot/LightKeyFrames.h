#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/FrameRange.h"
#include "environment/DropRadiance.h"

namespace virga::shot {

/// A sequence of environments that need not have every frame (pano.####.exr, as `virga env --every` writes it): the
/// light of frames between two of them is blended, that of frames before the first and after the last is held.
class LightKeyFrames {
public:
    using Read = std::function<environment::DropRadiance(const std::string& path)>;

    /// Throws Error(Input) if no file has a name like `pattern`.
    LightKeyFrames(const std::string& pattern, Read read);

    /// Brings `light` to the frame; false if it is the same as it was after the call before. What it holds depends on
    /// the frame alone, not on the calls before.
    bool moveTo(FrameNumber frame, environment::DropRadiance& light);

private:
    struct Key {
        FrameNumber number;
        environment::DropRadiance light;
    };
    const Key& key(FrameNumber number);

    std::string pattern_;
    Read read_;
    std::vector<FrameNumber> frames_;
    std::vector<Key> keys_;  // at most two
    std::optional<FrameNumber> previous_, next_;
    double between_ = 0;  // 0 at the first of the two, 1 at the second
};

}  // namespace virga::shot
