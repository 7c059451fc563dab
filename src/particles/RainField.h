// Which drops exist where at time t: co-moving hashed cells (docs/design.md).
//
// Each size class is a static Poisson field in the frame that falls with it and drifts with the wind. Space is cut into
// cubes there, and cube (i, j, k) of class s holds a Poisson number of drops whose places are a hash of
// (seed, s, i, j, k). For a picture, the camera's frustum is moved into each class's frame, in double precision, and
// the cells that it touches are listed. Nothing is stepped, nothing wraps around, nothing pops; frame 10,000,000 costs
// what frame 1 costs.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "camera/Camera.h"
#include "particles/Motion.h"
#include "particles/SharedShaders.h"
#include "rainfall/SizeClasses.h"

namespace virga::particles {

/// One exposure of the camera.
struct Exposure {
    double open_s = 0;      ///< when the shutter opens [s]
    double duration_s = 0;  ///< how long it stays open [s]; 0 freezes the drops
    camera::Pose poseAtOpen, poseAtClose;
    camera::Projection projection;  ///< at open
};

/// What limits the drops that are drawn one by one.
struct Visibility {
    double near_m = 0.3;       ///< nothing nearer is drawn
    double far_m = 500;        ///< nothing farther
    double threshold = 0.002;  ///< least matte value that a stroke must reach (opacity multiplier divided out)
    double blurAngle = 0;      ///< half the angle that a near drop's blur adds to its outline, beyond its path [rad]
};

/// The drops that a picture may need: input of the GPU and of dropInCell().
struct CellList {
    std::vector<shared::Cell> cells;
    std::vector<shared::DropClass> classes;  ///< all of the field's, in order; Cell::key.z indexes them
    std::array<shared::TurbulenceWave, 4> waves{};
    std::vector<std::uint32_t> blocks;  ///< cell of the first of every dropsPerBlock drops
    std::size_t drops = 0;              ///< in all cells: an upper bound on the strokes

    /// Drops of cell c: up to the first drop of the next cell.
    std::uint32_t dropsIn(std::size_t c) const
    {
        return (c + 1 < cells.size() ? cells[c + 1].key.w : std::uint32_t(drops)) - cells[c].key.w;
    }
};

class RainField {
public:
    static constexpr double mostCellsLookedAt = 1e9;            ///< a few seconds
    static constexpr std::size_t mostDropsInView = 30'000'000;  ///< over 2 GB of strokes
    static constexpr double mostCellsAway = 1e14;  ///< of the camera from the origin: cells still have neighbours

    /// classes: from makeSizeClasses; slope: of their size distribution [1/m].
    /// densityScale multiplies the number of drops (`--strokes`), > 0. dropsPerCell: aimed at; small cells hug the
    /// frustum, large ones keep the list short where there are millions of drops. Another number is another rain.
    RainField(std::vector<rainfall::SizeClass> classes, double slope, const Motion& motion, std::uint32_t seed,
              double densityScale = 1, double dropsPerCell = 8);

    /// dropsPerCell for a picture of so many strokes.
    static double dropsPerCellFor(double strokes);

    /// Cells that may hold a drop that is seen. Order means nothing. Parallel over classes.
    /// Throws Error(InvalidArgument) rather than look at more than mostCellsLookedAt or list more than mostDropsInView,
    /// which long exposures, narrow lenses and far limits could ask for, and beyond mostCellsAway.
    CellList cellsInView(const Exposure& exposure, const Visibility& visibility) const;

    /// Strokes that an average picture shows: the integral of number density over the frustum out to each diameter's
    /// visible depth. The drops that enter through the frustum's sides during the exposure are not in it.
    double expectedStrokes(const camera::Projection& projection, double exposure_s, const Visibility& visibility) const;

    /// Optical depth [1] from the camera to `depth_m` of the drops that are not drawn one by one: each class from its
    /// drops' visible depth onward, and all drops under the smallest class. `efficiency` Q = 1: the drops' shadow,
    /// which is what strokes cover too, so that drawn and undrawn drops dim the scene alike. allDrops: extinction of
    /// the whole distribution per unit of density scale [1/m] at Q = 1.
    double undrawnOpticalDepth(double depth_m, double focal_px, double exposure_s, const Visibility& visibility,
                               double allDrops) const;

    const std::vector<rainfall::SizeClass>& classes() const { return classes_; }
    double cellEdge(std::size_t dropClass) const { return edges_[dropClass]; }  ///< [m]
    double densityScale() const { return densityScale_; }
    const Motion& motion() const { return motion_; }

private:
    void appendClass(std::size_t dropClass, const Exposure& exposure, const Visibility& visibility,
                     std::atomic<double>& lookedAt, std::atomic<std::size_t>& inView, std::vector<shared::Cell>& cells,
                     std::size_t& drops) const;

    std::vector<rainfall::SizeClass> classes_;
    double slope_;
    Motion motion_;
    std::uint32_t seed_;
    double densityScale_;
    std::vector<double> edges_;
};

}  // namespace virga::particles
