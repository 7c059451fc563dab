// Which drops exist where at time t: co-moving hashed cells (docs/design.md).
//
// Each size class is a static Poisson field in the frame that falls with it and drifts with the wind; it is the sum of
// three sparser ones, its layers, so that where only a part of many faint drops is drawn (drawnShare), the others are
// not even listed. Space is cut into cubes, and cube (i, j, k) of layer n holds a Poisson number of drops whose places
// are a hash of (seed, n, i, j, k). For a picture, the camera's frustum is moved into each class's frame, in double
// precision, and the cells that it touches are listed. Nothing is stepped, nothing wraps around, nothing pops; frame
// 10,000,000 costs what frame 1 costs.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "camera/Camera.h"
#include "particles/HiddenCells.h"
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
    double thin = 0;           ///< matte value under which strokes are thinned out, see drawnShare; 0: none are
    double aperture_m = 0;     ///< of the lens, which blurs what is out of focus beyond its outline
    double focus_m = 10;       ///< distance that is in focus
    const HiddenCells* hidden = nullptr;  ///< what the scene stands in front of is not listed; null: everything is
    /// False: cells are listed of which nothing is drawn, in the box around the view and out to `far_m`. For tests and
    /// benchmarks of what that saves.
    bool skipsOutOfView = true, skipsFaint = true;
};

/// The drops that a picture may need: input of the GPU and of dropInCell().
struct CellList {
    std::vector<shared::Cell> cells;
    std::vector<shared::DropClass> classes;  ///< one for each of the field's layers, in order; Cell::key.z indexes them
    std::array<shared::TurbulenceWave, 4> waves{};
    std::vector<std::uint32_t> blocks;  ///< cell of the first of every dropsPerBlock drops
    std::size_t drops = 0;              ///< in all cells: an upper bound on the strokes
    std::size_t hiddenCells = 0;        ///< left out by Visibility::hidden

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
              double densityScale = 1, double dropsPerCell = 32);

    /// dropsPerCell for a picture of so many strokes.
    static double dropsPerCellFor(double strokes);

    /// Cells that may hold a drop that is seen. Order means nothing. Parallel over classes.
    /// Throws Error(InvalidArgument) rather than look at more than mostCellsLookedAt or list more than mostDropsInView,
    /// which long exposures, narrow lenses and far limits could ask for, and beyond mostCellsAway.
    CellList cellsInView(const Exposure& exposure, const Visibility& visibility) const;

    /// Strokes that an average picture shows: the integral of number density, thinned out where it is, over the frustum
    /// out to each diameter's visible depth. The drops that enter through the frustum's sides during the exposure are
    /// not in it.
    double expectedStrokes(const camera::Projection& projection, double exposure_s, const Visibility& visibility) const;

    /// Optical depth [1] from the camera to `depth_m` of the drops that are not drawn one by one: each class from its
    /// drops' visible depth onward, and all drops under the smallest class. `efficiency` Q = 1: the drops' shadow,
    /// which is what strokes cover too, so that drawn and undrawn drops dim the scene alike. allDrops: extinction of
    /// the whole distribution per unit of density scale [1/m] at Q = 1.
    double undrawnOpticalDepth(double depth_m, double focal_px, double exposure_s, const Visibility& visibility,
                               double allDrops) const;

    /// The part of a beam out to `depth_m` that the strokes which are thinned out do not draw: 1 - q of the optical
    /// depth [1] of their drops, at Q = 1, as the others draw q of it.
    double thinnedOpticalDepth(double depth_m, double focal_px, double exposure_s, const Visibility& visibility) const;

    /// How many of the strokes that are thinned out, as they are drawn then, lie over a pixel, in the mean.
    double thinnedOverlap(double focal_px, double exposure_s, const Visibility& visibility) const;

    /// The largest value up to visibility.thin with which those still lie close enough, leastOverlap of them over a
    /// pixel: sparser ones would be seen as strokes of their own instead of texture. The threshold, at which nothing is
    /// thinned, if there is none. leastOverlap was chosen by eye: at 0.36 a 1080p street of 184,000 strokes cannot be
    /// told from the 1.35 million that they stand for, at 0.14 its rain looks coarse.
    double thinnableTo(double focal_px, double exposure_s, const Visibility& visibility) const;
    static constexpr double leastOverlap = 0.35;

    /// Some of the drops of a size class: those of the ranks [least, least + range), in cells of their own.
    struct Layer {
        std::size_t sizeClass;
        double leastRank, ranks;
        double cellEdge;  ///< [m]
    };
    const std::vector<rainfall::SizeClass>& classes() const { return classes_; }
    const std::vector<Layer>& layers() const { return layers_; }
    const rainfall::SizeClass& classOf(std::size_t layer) const { return classes_[layers_[layer].sizeClass]; }
    /// Drops of a layer [1/m^3].
    double numberPerVolume(std::size_t layer) const
    {
        return classOf(layer).numberPerVolume * densityScale_ * layers_[layer].ranks;
    }
    double densityScale() const { return densityScale_; }
    const Motion& motion() const { return motion_; }

private:
    void appendLayer(std::size_t number, const Exposure& exposure, const Visibility& visibility,
                     std::atomic<double>& lookedAt, std::atomic<std::size_t>& inView, std::vector<shared::Cell>& cells,
                     std::size_t& drops, std::size_t& hidden) const;
    double visibleDepth(double diameter, const rainfall::SizeClass& c, double focal_px, double exposure_s,
                        double threshold) const;

    std::vector<rainfall::SizeClass> classes_;
    double slope_;
    Motion motion_;
    std::uint32_t seed_;
    double densityScale_;
    std::vector<Layer> layers_;
};

}  // namespace virga::particles
