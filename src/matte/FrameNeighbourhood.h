// The frames round an anchor, brought into its grid, and what they agree on: a picture without rain to refine against.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/Image.h"
#include "matte/PlaneTransform.h"

namespace virga::matte::alignment {

/// Frames are by number; `placed` has frame from reference, normalised, of those that have a place, the anchor among
/// them. Of these the nine that are nearest to the anchor in number, itself among them, are taken.
class FrameNeighbourhood {
public:
    /// `pictureOf` gives a frame's picture of level 0, and is called from many threads.
    FrameNeighbourhood(std::size_t anchor, std::span<const std::optional<PlaneTransform>> placed, const Grid& grid,
                       const std::function<ImageF(std::size_t)>& pictureOf);

    std::size_t size() const { return frames_.size(); }
    bool contains(std::size_t k) const;

    /// The median of all but one, if that is among them: a frame that is compared with itself stays where it is. 0
    /// where none reaches.
    ImageF medianWithout(std::size_t k) const;

private:
    std::vector<std::size_t> frames_;
    std::vector<ImageF> pictures_;  // NaN where they do not reach
};

}  // namespace virga::matte::alignment
