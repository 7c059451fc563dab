// Cells of drops that the scene stands in front of: every stroke of theirs would be drawn and then thrown away, pixel
// by pixel, by the comparison with the scene's depth. What is left out never shows: the picture is the same, bit for
// bit.
#pragma once

#include <glm/vec3.hpp>
#include <vector>

#include "core/Image.h"

namespace virga::particles {

/// The farthest depth in any box of a picture: a pyramid of maxima over tiles of pixels.
class FarthestDepth {
public:
    static constexpr int tile = 8;  ///< pixels a side at the pyramid's foot

    /// depth  width x height x 1 [m], +inf sky, no NaN. Not kept. Parallel over rows of tiles.
    explicit FarthestDepth(ConstImageViewF depth);

    /// No less than the depth of any pixel that the box touches [m], whatever its size by four look-ups; pixels just
    /// around it may count. 0 if no pixel of the picture is in it. Pixel (x, y) is the square [x, x + 1) x [y, y + 1).
    float in(double left, double top, double right, double bottom) const noexcept;

    /// Nothing nearer than this is behind anything: the least `in` of a tile [m].
    float nearestWall() const noexcept { return nearestWall_; }

    std::size_t bytes() const noexcept;

private:
    int width_, height_;
    float nearestWall_;
    std::vector<ImageF> levels_;  // each tile of a level covers 2 x 2 of the one before
};

/// The lens that strokes are drawn with, as far as it says how wide they are.
struct StrokeLens {
    double leastFocal_px = 0, greatestFocal_px = 0;  ///< while the shutter is open
    double axisX_px = 0, axisY_px = 0;               ///< optical axis on the picture
    double aperture_m = 0;                           ///< diameter
    double inverseFocus_1_m = 0;
    double near_m = 0;               ///< nothing nearer is drawn
    double matteWidthDiameters = 1;  ///< how wide the mattes' tiles are
};

class HiddenCells {
public:
    /// `depth` must live as long.
    HiddenCells(const FarthestDepth& depth, const StrokeLens& lens) : depth_(depth), lens_(lens) {}

    /// True if no stroke of a drop that stays within a ball while the shutter is open can be seen. The ball's centre in
    /// the axes of the camera as it stands at open and as it stands at close, from the camera [m]; radius [m];
    /// diameter: of the largest drop [m]. False for balls that reach nearer than the lens's near limit.
    bool hides(const glm::dvec3& centreAtOpen, const glm::dvec3& centreAtClose, double radius,
               double diameter) const noexcept;

private:
    const FarthestDepth& depth_;
    StrokeLens lens_;
};

}  // namespace virga::particles
