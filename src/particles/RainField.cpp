#include "particles/RainField.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <mutex>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "particles/CellHash.h"
#include "particles/PoissonTable.h"

namespace virga::particles {
namespace {

constexpr double smallestCellEdge = 0.35;  // [m]; where drops crowd, the list of cells stays short
constexpr double largestCellEdge = 8;      // [m]; rare drops live in cells that hold less than one

/// The part of space that a camera sees, tested against balls.
class Frustum {
public:
    Frustum(const camera::Projection& projection, const glm::dmat3& worldFromCamera, double far, double blurAngle)
        : cameraFromWorld_(glm::transpose(worldFromCamera)), far_(far),
          // Half a pixel beyond the border: a stroke is never narrower than one.
          tanX_((0.5 * projection.width + 0.5) / projection.focal_px + blurAngle),
          tanY_((0.5 * projection.height + 0.5) / projection.focal_px + blurAngle), lengthX_(std::hypot(1.0, tanX_)),
          lengthY_(std::hypot(1.0, tanY_))
    {
    }

    bool touches(const glm::dvec3& centreFromCamera, double radius) const
    {
        const glm::dvec3 p = cameraFromWorld_ * centreFromCamera;
        const double depth = -p.z;
        return depth > -radius && depth < far_ + radius && std::abs(p.x) - tanX_ * depth < radius * lengthX_ &&
               std::abs(p.y) - tanY_ * depth < radius * lengthY_;
    }

    /// Distance from the camera to a far corner [m].
    double cornerDistance() const { return far_ * std::hypot(1.0, tanX_, tanY_); }

    /// Grows a box by the corners of the frustum out to `far` [m].
    void extend(glm::dvec3& low, glm::dvec3& high, double far) const
    {
        const glm::dmat3 worldFromCamera = glm::transpose(cameraFromWorld_);
        for (const double x : {-tanX_, tanX_})
            for (const double y : {-tanY_, tanY_}) {
                const glm::dvec3 corner = worldFromCamera * glm::dvec3(x * far, y * far, -far);
                low = glm::min(low, corner);
                high = glm::max(high, corner);
            }
    }

private:
    glm::dmat3 cameraFromWorld_;
    double far_, tanX_, tanY_, lengthX_, lengthY_;
};

/// sin(angle / 2) of the rotation between two orientations.
double halfTurn(const glm::dmat3& a, const glm::dmat3& b)
{
    const double trace = glm::dot(a[0], b[0]) + glm::dot(a[1], b[1]) + glm::dot(a[2], b[2]);  // 1 + 2 cos(angle)
    return std::sqrt(std::max(0.0, 0.25 * (3 - trace)));
}

constexpr const char* whatHelps =
    "lower --far, --speed or --wind, raise --threshold or --fstop, or shorten the exposure";

/// Adds the cells of a box, in cells, to those that all classes look at. Throws Error(InvalidArgument).
void refuseExcess(const glm::dvec3& low, const glm::dvec3& high, std::atomic<double>& lookedAt)
{
    const glm::dvec3 farthest = glm::max(glm::abs(low), glm::abs(high));
    if (!(std::max({farthest.x, farthest.y, farthest.z}) < RainField::mostCellsAway))
        throw Error(ErrorCode::InvalidArgument,
                    "camera and rain are too far from where they began for drops to be told apart: there is no frame "
                    "for this number, camera and speed of the rain");
    const glm::dvec3 sides = glm::floor(high) - glm::floor(low) + 1.0;
    const double cells = sides.x * sides.y * sides.z;
    if (lookedAt.fetch_add(cells) + cells > RainField::mostCellsLookedAt)
        throw Error(ErrorCode::InvalidArgument,
                    "rain is looked for in over {:.0g} cells of the air while the shutter is open: {}",
                    RainField::mostCellsLookedAt, whatHelps);
}

void refuseExcess(std::size_t inView)
{
    if (inView > RainField::mostDropsInView)
        throw Error(ErrorCode::InvalidArgument,
                    "over {} drops may cross the picture while the shutter is open, more than can be drawn: {}",
                    RainField::mostDropsInView, whatHelps);
}

double visibleDepth(double diameter, double speed, double focal_px, double exposure_s, double threshold)
{
    return double(shared::visibleDepth(float(diameter), float(speed * exposure_s), float(focal_px), float(threshold)));
}

}  // namespace

RainField::RainField(std::vector<rainfall::SizeClass> classes, double slope, const Motion& motion, std::uint32_t seed,
                     double densityScale, double dropsPerCell)
    : classes_(std::move(classes)), slope_(slope), motion_(motion), seed_(seed), densityScale_(densityScale)
{
    // The edge depends on the rain alone, never on the shot: a change of lens must not move the drops.
    for (const rainfall::SizeClass& c : classes_)
        edges_.push_back(std::clamp(std::cbrt(dropsPerCell / (c.numberPerVolume * densityScale_)), smallestCellEdge,
                                    largestCellEdge));
}

double RainField::dropsPerCellFor(double strokes) { return std::clamp(strokes / 3e4, 8.0, 96.0); }

void RainField::appendClass(std::size_t dropClass, const Exposure& exposure, const Visibility& visibility,
                            std::atomic<double>& lookedAt, std::atomic<std::size_t>& inView,
                            std::vector<shared::Cell>& cells, std::size_t& drops) const
{
    const rainfall::SizeClass& c = classes_[dropClass];
    const double edge = edges_[dropClass];
    const double far = std::min(visibility.far_m, visibleDepth(c.d1, c.speed, exposure.projection.focal_px,
                                                               exposure.duration_s, visibility.threshold));
    if (far <= visibility.near_m) return;

    const glm::dvec3 fallen = motion_.displacement(c.speed, exposure.open_s);
    const glm::dvec3 way = motion_.displacement(c.speed, exposure.open_s + exposure.duration_s) - fallen -
                           (exposure.poseAtClose.position - exposure.poseAtOpen.position);
    const double reach = motion_.turbulenceReach();
    const Frustum atOpen(exposure.projection, exposure.poseAtOpen.worldFromCamera, far, visibility.blurAngle);
    const Frustum atClose(exposure.projection, exposure.poseAtClose.worldFromCamera, far, visibility.blurAngle);

    // A stroke is the picture of the straight line, in camera axes, between where the turning camera sees the drop at
    // open and at close. That line may cut a corner of the picture that neither end is in; but each point of it is
    // nearer to one of them than half of what the turn adds, |R x - x| = 2 sin(angle / 2) |x|.
    const double turn = halfTurn(exposure.poseAtOpen.worldFromCamera, exposure.poseAtClose.worldFromCamera);
    const double margin = reach + 0.5 * c.d1;
    const double sweep = turn * (atOpen.cornerDistance() + glm::length(way));

    // The frustum in the class's own frame, from the camera at open; a drop must come from where `way` can bring it in.
    // Far is a limit on the middle of the way: one end may be beyond.
    glm::dvec3 low(0.0), high(0.0);
    const double beyond = far + 0.5 * glm::length(way) + sweep;
    atOpen.extend(low, high, beyond);
    atClose.extend(low, high, beyond);
    const glm::dvec3 cameraInField = exposure.poseAtOpen.position - fallen;
    low = cameraInField + low - glm::max(way, glm::dvec3(0.0)) - margin - sweep;
    high = cameraInField + high - glm::min(way, glm::dvec3(0.0)) + margin + sweep;

    refuseExcess(low / edge, high / edge, lookedAt);
    const auto cellOf = [&](double x) { return std::int64_t(std::floor(x / edge)); };
    const double halfDiagonal = 0.5 * std::numbers::sqrt3 * edge;
    const double still = halfDiagonal + margin + 0.5 * glm::length(way);
    const PoissonTable poisson(c.numberPerVolume * densityScale_ * edge * edge * edge);

    std::size_t counted = 0;
    for (std::int64_t k = cellOf(low.z); k <= cellOf(high.z); ++k)
        for (std::int64_t j = cellOf(low.y); j <= cellOf(high.y); ++j) {
            refuseExcess(inView += drops - counted);
            counted = drops;
            for (std::int64_t i = cellOf(low.x); i <= cellOf(high.x); ++i) {
                const glm::dvec3 corner = edge * glm::dvec3(double(i), double(j), double(k));
                const glm::dvec3 origin = corner - cameraInField;
                const glm::dvec3 middle = origin + 0.5 * edge + 0.5 * way;
                const double radius = still + turn * (glm::length(middle) + still);
                if (!atOpen.touches(middle, radius) && !atClose.touches(middle, radius)) continue;

                const std::uint64_t hash = cellHash(seed_, std::int64_t(dropClass), i, j, k);
                const int count = poisson(unitDouble(mix(hash)));
                if (count == 0) continue;
                shared::Cell cell;
                cell.key = {std::uint32_t(hash), std::uint32_t(hash >> 32), std::uint32_t(dropClass),
                            std::uint32_t(drops)};
                cell.origin = glm::vec4(glm::vec3(origin), 0.0f);
                cell.phase = motion_.hasTurbulence() ? motion_.turbulencePhases(corner, exposure.open_s, int(dropClass))
                                                     : glm::vec4(0.0f);
                cells.push_back(cell);
                drops += std::size_t(count);
            }
        }
    refuseExcess(inView += drops - counted);
}

CellList RainField::cellsInView(const Exposure& exposure, const Visibility& visibility) const
{
    CellList list;
    list.waves = motion_.turbulenceWaves(exposure.duration_s);
    const glm::dvec3 cameraWay = exposure.poseAtClose.position - exposure.poseAtOpen.position;
    for (const rainfall::SizeClass& c : classes_) {
        const glm::dvec3 way = motion_.displacement(c.speed, exposure.open_s + exposure.duration_s) -
                               motion_.displacement(c.speed, exposure.open_s) - cameraWay;
        const std::size_t index = list.classes.size();
        list.classes.push_back({glm::vec4(float(c.d0), float(c.d1), float(slope_), float(edges_[index])),
                                glm::vec4(glm::vec3(way), float(c.speed))});
    }

    std::atomic<double> lookedAt{0};
    std::atomic<std::size_t> inView{0};
    std::mutex mutex;
    parallelFor(0, std::ptrdiff_t(classes_.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t s = first; s < last; ++s) {
            std::vector<shared::Cell> cells;
            std::size_t drops = 0;
            appendClass(std::size_t(s), exposure, visibility, lookedAt, inView, cells, drops);
            const std::lock_guard lock(mutex);
            for (shared::Cell& cell : cells) cell.key.w += std::uint32_t(list.drops);
            list.cells.insert(list.cells.end(), cells.begin(), cells.end());
            list.drops += drops;
        }
    });
    // For each block of drops the cell that holds its first.
    std::size_t cell = 0;
    for (std::size_t drop = 0; drop < list.drops; drop += shared::dropsPerBlock) {
        while (cell + 1 < list.cells.size() && list.cells[cell + 1].key.w <= drop) ++cell;
        list.blocks.push_back(std::uint32_t(cell));
    }
    return list;
}

double RainField::expectedStrokes(const camera::Projection& projection, double exposure_s,
                                  const Visibility& visibility) const
{
    const double solidAngle =
        double(projection.width) * projection.height / (projection.focal_px * projection.focal_px);
    double strokes = 0;
    for (const rainfall::SizeClass& c : classes_) {
        // Mean of (far^3 - near^3) / 3 over the class's diameters, by the midpoint rule over equal shares of drops.
        constexpr int shares = 16;
        double volume = 0;
        for (int i = 0; i < shares; ++i) {
            const double diameter = double(
                shared::truncatedExponential((float(i) + 0.5f) / shares, float(c.d0), float(c.d1), float(slope_)));
            const double far = std::min(visibility.far_m, visibleDepth(diameter, c.speed, projection.focal_px,
                                                                       exposure_s, visibility.threshold));
            if (far > visibility.near_m)
                volume += solidAngle * (std::pow(far, 3) - std::pow(visibility.near_m, 3)) / 3 / shares;
        }
        strokes += c.numberPerVolume * densityScale_ * volume;
    }
    return strokes;
}

double RainField::undrawnOpticalDepth(double depth_m, double focal_px, double exposure_s, const Visibility& visibility,
                                      double allDrops) const
{
    const double depth = std::min(depth_m, visibility.far_m);
    double drawnDepth = 0, drawnExtinction = 0;
    for (const rainfall::SizeClass& c : classes_) {
        const double extinction = std::numbers::pi / 4 * c.meanSquare * c.numberPerVolume * densityScale_;
        constexpr int shares = 16;  // as in expectedStrokes, weighted with each share's shadow
        double squares = 0, undrawn = 0;
        for (int i = 0; i < shares; ++i) {
            const double d = double(
                shared::truncatedExponential((float(i) + 0.5f) / shares, float(c.d0), float(c.d1), float(slope_)));
            const double visible = visibleDepth(d, c.speed, focal_px, exposure_s, visibility.threshold);
            squares += d * d;
            undrawn += d * d * std::max(0.0, depth - (visible > visibility.near_m ? visible : 0.0));
        }
        drawnDepth += extinction * undrawn / squares;
        drawnExtinction += extinction;
    }
    return drawnDepth + std::max(0.0, allDrops * densityScale_ - drawnExtinction) * depth;
}

}  // namespace virga::particles
