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

/// Where the ranks of a class are cut into layers. Drops of the last are listed as far as their strokes reach half of
/// Visibility::thin, those of the second as far as they reach a quarter.
constexpr std::array<double, 4> rankCuts = {0, 1.0 / 16, 1.0 / 4, 1};

/// The part of space that a camera sees, tested against balls.
class Frustum {
public:
    Frustum(const camera::Projection& projection, const glm::dmat3& worldFromCamera, double far,
            const Visibility& visibility)
        : cameraFromWorld_(glm::transpose(worldFromCamera)), far_(far), halfAperture_(0.5 * visibility.aperture_m),
          inverseFocus_(1 / visibility.focus_m),
          // Half a pixel beyond the border: a stroke is never narrower than one.
          borders_(camera::bordersOf(projection, 0.5)), lengthLeft_(std::hypot(1.0, borders_.left)),
          lengthRight_(std::hypot(1.0, borders_.right)), lengthBottom_(std::hypot(1.0, borders_.bottom)),
          lengthTop_(std::hypot(1.0, borders_.top))
    {
    }

    glm::dvec3 inCamera(const glm::dvec3& fromCamera) const { return cameraFromWorld_ * fromCamera; }

    bool touches(const glm::dvec3& centreFromCamera, double radius) const
    {
        const glm::dvec3 p = inCamera(centreFromCamera);
        const double depth = -p.z;
        const double blur = std::max(blurAt(depth - radius), blurAt(depth + radius));
        return depth > -radius && depth < far_ + radius &&
               p.x - borders_.right * depth < radius * lengthRight_ + blur &&
               borders_.left * depth - p.x < radius * lengthLeft_ + blur &&
               p.y - borders_.top * depth < radius * lengthTop_ + blur &&
               borders_.bottom * depth - p.y < radius * lengthBottom_ + blur;
    }

    /// Distance from the camera to a far corner [m].
    double cornerDistance() const
    {
        return far_ * std::hypot(1.0, std::max(std::abs(borders_.left), std::abs(borders_.right)),
                                 std::max(std::abs(borders_.bottom), std::abs(borders_.top)));
    }

    /// Grows a box by the corners of the frustum out to `far` [m].
    void extend(glm::dvec3& low, glm::dvec3& high, double far) const
    {
        const glm::dmat3 worldFromCamera = glm::transpose(cameraFromWorld_);
        for (const double x : {borders_.left, borders_.right})
            for (const double y : {borders_.bottom, borders_.top}) {
                const glm::dvec3 corner = worldFromCamera * glm::dvec3(x * far, y * far, -far);
                low = glm::min(low, corner);
                high = glm::max(high, corner);
            }
        const double blur = std::max(blurAt(0), blurAt(far));
        low -= blur;
        high += blur;
    }

private:
    /// How far beyond its outline a drop at `depth` is seen [m]: half the circle of confusion there. Its extremes are
    /// at the ends of an interval of depths.
    double blurAt(double depth) const { return halfAperture_ * std::abs(1 - std::max(depth, 0.0) * inverseFocus_); }

    glm::dmat3 cameraFromWorld_;
    double far_, halfAperture_, inverseFocus_;
    camera::Borders borders_;
    double lengthLeft_, lengthRight_, lengthBottom_, lengthTop_;  // of a border's normal, not of length 1
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

/// Mean over equal shares of a class's drops, by the midpoint rule: value(diameter) weighted with weight(diameter).
template <class Value, class Weight>
double meanOverDrops(const rainfall::SizeClass& c, double slope, Value&& value, Weight&& weight)
{
    constexpr int shares = 16;
    double sum = 0, weights = 0;
    for (int i = 0; i < shares; ++i) {
        const double d =
            double(shared::truncatedExponential((float(i) + 0.5f) / shares, float(c.d0), float(c.d1), float(slope)));
        sum += weight(d) * value(d);
        weights += weight(d);
    }
    return sum / weights;
}

/// Integral of 1 / (z (path + z)) dz.
double integralOfShare(double path, double from, double to)
{
    const double x = (to - from) / (from * (path + to));
    return path * x > 1e-6 ? std::log1p(path * x) / path : x;
}

}  // namespace

RainField::RainField(std::vector<rainfall::SizeClass> classes, double slope, const Motion& motion, std::uint32_t seed,
                     double densityScale, double dropsPerCell)
    : classes_(std::move(classes)), slope_(slope), motion_(motion), seed_(seed), densityScale_(densityScale)
{
    // The edge depends on the rain alone, never on the shot: a change of lens must not move the drops.
    for (std::size_t cut = 0; cut + 1 < rankCuts.size(); ++cut)
        for (std::size_t s = 0; s < classes_.size(); ++s) {
            const double ranks = rankCuts[cut + 1] - rankCuts[cut];
            const double density = classes_[s].numberPerVolume * densityScale_ * ranks;
            layers_.push_back({s, rankCuts[cut], ranks,
                               std::clamp(std::cbrt(dropsPerCell / density), smallestCellEdge, largestCellEdge)});
        }
}

double RainField::dropsPerCellFor(double strokes) { return std::clamp(strokes / 12500, 32.0, 400.0); }

double RainField::visibleDepth(double diameter, const rainfall::SizeClass& c, double focal_px, double exposure_s,
                               double threshold) const
{
    return double(shared::visibleDepth(float(diameter), float(motion_.fallSpeed(c.speed) * exposure_s), float(focal_px),
                                       float(threshold)));
}

void RainField::appendLayer(std::size_t number, const Exposure& exposure, const Visibility& visibility,
                            std::atomic<double>& lookedAt, std::atomic<std::size_t>& inView,
                            std::vector<shared::Cell>& cells, std::size_t& drops, std::size_t& hidden) const
{
    const Layer& layer = layers_[number];
    const rainfall::SizeClass& c = classes_[layer.sizeClass];
    const double edge = layer.cellEdge;
    // A drop is drawn where q^2 is over its rank.
    const double faintest = std::max(visibility.threshold, visibility.thin * std::sqrt(layer.leastRank));
    double far = visibility.far_m;
    if (visibility.skipsFaint)
        far = std::min(far, visibleDepth(c.d1, c, exposure.projection.fullFocal_px(), exposure.duration_s, faintest));
    if (far <= visibility.near_m) return;

    const glm::dvec3 fallen = motion_.displacement(c.speed, exposure.open_s);
    const glm::dvec3 way = motion_.displacement(c.speed, exposure.open_s + exposure.duration_s) - fallen -
                           (exposure.poseAtClose.position - exposure.poseAtOpen.position);
    const double reach = motion_.turbulenceReach();
    const Frustum atOpen(exposure.projection, exposure.poseAtOpen.worldFromCamera, far, visibility);
    const Frustum atClose(exposure.projection, exposure.poseAtClose.worldFromCamera, far, visibility);

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
    const PoissonTable poisson(numberPerVolume(number) * edge * edge * edge);

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
                if (visibility.skipsOutOfView && !atOpen.touches(middle, radius) && !atClose.touches(middle, radius))
                    continue;
                if (visibility.hidden != nullptr &&
                    visibility.hidden->hides(atOpen.inCamera(middle), atClose.inCamera(middle), radius, c.d1)) {
                    ++hidden;
                    continue;
                }

                const std::uint64_t hash = cellHash(seed_, std::int64_t(number), i, j, k);
                const int count = poisson(unitDouble(mix(hash)));
                if (count == 0) continue;
                shared::Cell cell;
                cell.key = {std::uint32_t(hash), std::uint32_t(hash >> 32), std::uint32_t(number),
                            std::uint32_t(drops)};
                cell.origin = glm::vec4(glm::vec3(origin), 0.0f);
                cell.phase = motion_.hasTurbulence()
                                 ? motion_.turbulencePhases(corner, exposure.open_s, int(layer.sizeClass))
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
    for (const Layer& layer : layers_) {
        const rainfall::SizeClass& c = classes_[layer.sizeClass];
        const glm::dvec3 way = motion_.displacement(c.speed, exposure.open_s + exposure.duration_s) -
                               motion_.displacement(c.speed, exposure.open_s) - cameraWay;
        list.classes.push_back({glm::vec4(float(c.d0), float(c.d1), float(slope_), float(layer.cellEdge)),
                                glm::vec4(glm::vec3(way), float(motion_.fallSpeed(c.speed))),
                                glm::vec4(float(layer.leastRank), float(layer.ranks), 0.0f, 0.0f)});
    }

    std::atomic<double> lookedAt{0};
    std::atomic<std::size_t> inView{0};
    std::mutex mutex;
    parallelFor(0, std::ptrdiff_t(layers_.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t s = first; s < last; ++s) {
            std::vector<shared::Cell> cells;
            std::size_t drops = 0, hidden = 0;
            appendLayer(std::size_t(s), exposure, visibility, lookedAt, inView, cells, drops, hidden);
            const std::lock_guard lock(mutex);
            for (shared::Cell& cell : cells) cell.key.w += std::uint32_t(list.drops);
            list.cells.insert(list.cells.end(), cells.begin(), cells.end());
            list.drops += drops;
            list.hiddenCells += hidden;
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
    const double focal = projection.fullFocal_px();
    double strokes = 0;
    for (const rainfall::SizeClass& c : classes_) {
        const double path = focal * motion_.fallSpeed(c.speed) * exposure_s;
        const auto depthOf = [&](double diameter, double threshold) {
            return std::clamp(visibleDepth(diameter, c, focal, exposure_s, threshold), visibility.near_m,
                              std::max(visibility.far_m, visibility.near_m));
        };
        const auto volume = [&](double diameter) {
            const double far = depthOf(diameter, visibility.threshold);
            if (!(visibility.thin > visibility.threshold))
                return (std::pow(far, 3) - std::pow(visibility.near_m, 3)) / 3;
            const double whole = depthOf(diameter, visibility.thin);
            // q = reached / (z (path + z)): the integral of z^2 q^2 over the rest.
            const double reached = std::numbers::pi / 4 * std::pow(focal * diameter, 2) / visibility.thin;
            return (std::pow(whole, 3) - std::pow(visibility.near_m, 3)) / 3 +
                   reached * reached * (far - whole) / ((path + whole) * (path + far));
        };
        strokes += c.numberPerVolume * densityScale_ * solidAngle *
                   meanOverDrops(c, slope_, volume, [](double) { return 1.0; });
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
        const auto undrawn = [&](double diameter) {
            const double visible = visibleDepth(diameter, c, focal_px, exposure_s, visibility.threshold);
            return std::max(0.0, depth - (visible > visibility.near_m ? visible : 0.0));
        };
        drawnDepth += extinction * meanOverDrops(c, slope_, undrawn, [](double d) { return d * d; });
        drawnExtinction += extinction;
    }
    return drawnDepth + std::max(0.0, allDrops * densityScale_ - drawnExtinction) * depth;
}

double RainField::thinnedOpticalDepth(double depth_m, double focal_px, double exposure_s,
                                      const Visibility& visibility) const
{
    if (!(visibility.thin > visibility.threshold)) return 0;
    const double depth = std::min(depth_m, visibility.far_m);
    double sum = 0;
    for (const rainfall::SizeClass& c : classes_) {
        const double path = focal_px * motion_.fallSpeed(c.speed) * exposure_s;
        const auto missing = [&](double diameter) {
            const double from =
                std::max(visibility.near_m, visibleDepth(diameter, c, focal_px, exposure_s, visibility.thin));
            const double to = std::min(depth, visibleDepth(diameter, c, focal_px, exposure_s, visibility.threshold));
            if (to <= from) return 0.0;
            const double reached = std::numbers::pi / 4 * std::pow(focal_px * diameter, 2) / visibility.thin;
            return std::max(0.0, to - from - reached * integralOfShare(path, from, to));
        };
        sum += std::numbers::pi / 4 * c.meanSquare * c.numberPerVolume * densityScale_ *
               meanOverDrops(c, slope_, missing, [](double d) { return d * d; });
    }
    return sum;
}

double RainField::thinnedOverlap(double focal_px, double exposure_s, const Visibility& visibility) const
{
    if (!(visibility.thin > visibility.threshold)) return 0;
    double sum = 0;
    for (const rainfall::SizeClass& c : classes_) {
        const double path = focal_px * motion_.fallSpeed(c.speed) * exposure_s;
        const auto overlap = [&](double diameter) {
            const double from =
                std::max(visibility.near_m, visibleDepth(diameter, c, focal_px, exposure_s, visibility.thin));
            const double to =
                std::min(visibility.far_m, visibleDepth(diameter, c, focal_px, exposure_s, visibility.threshold));
            if (to <= from) return 0.0;
            // Drops over a pixel at z: z^2 / f^2, of which q^2 are drawn, each over path / z + 1 pixels.
            const double reached = std::numbers::pi / 4 * focal_px * diameter * diameter / visibility.thin;
            return reached * reached * integralOfShare(path, from, to);
        };
        sum += c.numberPerVolume * densityScale_ * meanOverDrops(c, slope_, overlap, [](double) { return 1.0; });
    }
    return sum;
}

double RainField::thinnableTo(double focal_px, double exposure_s, const Visibility& visibility) const
{
    const auto overlapAt = [&](double thin) {
        Visibility v = visibility;
        v.thin = thin;
        return thinnedOverlap(focal_px, exposure_s, v);
    };
    double thin = visibility.thin, tooMuch = visibility.thin;
    if (!(thin > visibility.threshold) || overlapAt(thin) >= leastOverlap) return thin;
    // From above, as close to the threshold there is next to nothing to thin, and nothing that overlaps.
    for (; overlapAt(thin) < leastOverlap; thin *= 0.8) {
        if (thin < 1.5 * visibility.threshold) return visibility.threshold;
        tooMuch = thin;
    }
    for (int i = 0; i < 12; ++i) {
        const double middle = std::sqrt(thin * tooMuch);
        (overlapAt(middle) >= leastOverlap ? thin : tooMuch) = middle;
    }
    return thin;
}

}  // namespace virga::particles
