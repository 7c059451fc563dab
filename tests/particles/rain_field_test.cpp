#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>
#include <numbers>
#include <set>

#include "Drops.h"
#include "camera/Camera.h"
#include "particles/PoissonTable.h"
#include "rainfall/DropSizes.h"
#include "support/Files.h"
#include "support/Statistics.h"

namespace virga::particles {
namespace {

using rainfall::DropSizes;
using rainfall::SizeClass;
using test::byId;
using test::dropsOf;
using test::isInside;
using test::isVisible;
using test::SeenDrop;
using virga::test::ChiSquare;
using virga::test::chiSquareLimit;
using virga::test::kNormal1e4;

constexpr double pi = std::numbers::pi;
constexpr MotionSettings still{};
constexpr MotionSettings stormy = {.wind = {6, -3}, .gust = 2, .turbulence = 0.5, .seed = 3};

/// The rain of 25 mm/h, or one class of it alone.
RainField rainOf(const MotionSettings& motion, int onlyClass = -1, std::uint32_t seed = 7)
{
    const DropSizes sizes(25);
    std::vector<SizeClass> classes = rainfall::makeSizeClasses(sizes);
    if (onlyClass >= 0) classes = {classes[std::size_t(onlyClass)]};
    return {classes, sizes.slope(), Motion(motion), seed};
}

/// A frozen picture from a level camera with a horizontal field of view [deg].
Exposure frozenAt(double t, double fov_deg = 90, int width = 400, int height = 400)
{
    Exposure exposure;
    exposure.open_s = t;
    exposure.projection = camera::projectionFromHorizontalFov(width, height, glm::radians(fov_deg));
    return exposure;
}

/// The layer of a field of one class that holds three quarters of its drops.
constexpr std::size_t densest = 2;

/// So low a threshold that every drop out to `far` is drawn.
Visibility everythingTo(double far, double near = 0.1) { return {.near_m = near, .far_m = far, .threshold = 1e-9}; }

double frustumVolume(const Exposure& exposure, double near, double far)
{
    const double solid = double(exposure.projection.width) * exposure.projection.height /
                         (exposure.projection.focal_px * exposure.projection.focal_px);
    return solid * (far * far * far - near * near * near) / 3;
}

// Cells. All cells that lie inside the frustum are asked for their number of drops; those that are not listed have
// none. About 1,000 cells of each of five classes; each chi-square fails by chance once in 10,000.
TEST(Cells, HoldAPoissonNumberOfDrops)
{
    for (const int s : {0, 8, 16, 24, 31}) {
        const RainField field = rainOf(still, s);
        const double edge = field.layers()[densest].cellEdge, far = 12 * edge;
        const double mean = field.numberPerVolume(densest) * edge * edge * edge;
        const Exposure exposure = frozenAt(0);
        const CellList list = field.cellsInView(exposure, everythingTo(far));
        std::unordered_map<std::uint64_t, int> counts;
        const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) { return cellHash(0, 0, i, j, k); };
        for (std::size_t c = 0; c < list.cells.size(); ++c) {
            if (list.cells[c].key.z != densest) continue;
            const glm::dvec3 at = glm::round(glm::dvec3(list.cells[c].origin) / edge);
            counts[key(std::int64_t(at.x), std::int64_t(at.y), std::int64_t(at.z))] = int(list.dropsIn(c));
        }
        const int last = int(mean + 12 * std::sqrt(mean) + 24);
        std::vector<int> seen(std::size_t(last) + 1);
        int cells = 0;
        double squares = 0;
        for (std::int64_t k = -13; k < 13; ++k)
            for (std::int64_t j = -13; j < 13; ++j)
                for (std::int64_t i = -13; i < 13; ++i) {
                    const glm::dvec3 middle = edge * (glm::dvec3(double(i), double(j), double(k)) + 0.5);
                    if (!isInside(middle, exposure, edge, far)) continue;
                    const auto found = counts.find(key(i, j, k));
                    const int n = found == counts.end() ? 0 : found->second;
                    ++seen[std::size_t(std::min(n, last))];
                    ++cells;
                    squares += (n - mean) * (n - mean) / mean;
                }
        ASSERT_GT(cells, 1000);
        std::vector<double> expected(seen.size());
        for (int n = 0; n <= last; ++n)
            expected[std::size_t(n)] = cells * std::exp(n * std::log(mean) - mean - std::lgamma(n + 1.0));
        const ChiSquare chiSquare(seen, expected);
        if (chiSquare.bins > 1) {
            EXPECT_LT(chiSquare.statistic, chiSquare.limit()) << "class " << s;
        }
        // Variance equal to the mean: chi-square with one degree of freedom a cell, where the mean is not small.
        if (mean > 4) {
            EXPECT_LT(squares, chiSquareLimit(cells)) << "class " << s;
        }
    }
}

// Boxes that have nothing to do with the cells: 1.37 cell edges wide, turned by nothing but shifted. Were drops of
// neighbouring cells correlated or cells not evenly filled, the variance of the counts would not be their mean. About
// 1,000 boxes with 20 drops each; two-sided, each end fails by chance once in 10,000.
TEST(Cells, NumberInAnyBoxIsPoisson)
{
    for (const int s : {2, 14}) {
        const RainField field = rainOf(still, s);
        const double edge = field.layers()[densest].cellEdge, box = 1.37 * edge, far = 18 * edge;
        const double mean = field.classes()[0].numberPerVolume * box * box * box;
        const Exposure exposure = frozenAt(0);
        std::unordered_map<std::uint64_t, int> counts;
        const auto boxOf = [&](const glm::dvec3& p) { return glm::floor((p + 0.3 * edge) / box); };
        const auto key = [](const glm::dvec3& b) {
            return cellHash(0, 0, std::int64_t(b.x), std::int64_t(b.y), std::int64_t(b.z));
        };
        for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, everythingTo(far))))
            ++counts[key(boxOf(drop.open))];
        int boxes = 0;
        double squares = 0, total = 0;
        for (int k = -14; k < 14; ++k)
            for (int j = -14; j < 14; ++j)
                for (int i = -14; i < 14; ++i) {
                    bool whole = true;
                    for (int corner = 0; corner < 8; ++corner) {
                        const glm::dvec3 at(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                        whole = whole && isInside(box * at - 0.3 * edge, exposure, 0.1, far);
                    }
                    if (!whole) continue;
                    const auto found = counts.find(key(glm::dvec3(i, j, k)));
                    const double n = found == counts.end() ? 0 : found->second;
                    ++boxes;
                    total += n;
                    squares += (n - mean) * (n - mean) / mean;
                }
        ASSERT_GT(boxes, 900);
        EXPECT_NEAR(total, boxes * mean, kNormal1e4 * std::sqrt(boxes * mean)) << "class " << s;
        EXPECT_LT(squares, chiSquareLimit(boxes)) << "class " << s;
        EXPECT_GT(squares, chiSquareLimit(boxes, -kNormal1e4)) << "class " << s;
    }
}

// 216 bins of place in the cell, about 25,000 drops of a class; then place against diameter, and a drop against the
// next of its cell, 8 x 8 bins each. Ten statistics, each fails by chance once in 10,000.
TEST(Cells, PlacesAreUniformAndIndependent)
{
    for (const int s : {3, 20}) {
        const RainField field = rainOf(still, s);
        const SizeClass& c = field.classes()[0];
        const CellList list = field.cellsInView(frozenAt(0), everythingTo(13 * field.layers()[densest].cellEdge));
        std::vector<int> places(216), next(64);
        std::array<std::vector<int>, 3> size = {std::vector<int>(64), std::vector<int>(64), std::vector<int>(64)};
        int drops = 0, pairs = 0;
        for (std::size_t n = 0; n < list.cells.size(); ++n) {
            double before = -1;
            const double edge = field.layers()[list.cells[n].key.z].cellEdge;
            for (std::uint32_t i = 0; i < list.dropsIn(n); ++i) {
                const SeenDrop drop = test::dropOf(list, list.cells[n], i);
                const glm::dvec3 local = (drop.open - glm::dvec3(list.cells[n].origin)) / edge;
                const auto bin = [](double x, int bins) { return std::size_t(std::clamp(int(x * bins), 0, bins - 1)); };
                for (int axis = 0; axis < 3; ++axis) {
                    EXPECT_GE(local[axis], -1e-5);
                    EXPECT_LT(local[axis], 1 + 1e-5);
                }
                ++places[bin(local.x, 6) + 6 * bin(local.y, 6) + 36 * bin(local.z, 6)];
                const double slope = DropSizes(25).slope();
                const double u = std::expm1(-slope * (drop.diameter - c.d0)) / std::expm1(-slope * (c.d1 - c.d0));
                for (int axis = 0; axis < 3; ++axis) ++size[std::size_t(axis)][bin(local[axis], 8) + 8 * bin(u, 8)];
                if (before >= 0) ++next[bin(before, 8) + 8 * bin(local.x, 8)], ++pairs;
                before = local.x;
                ++drops;
            }
        }
        ASSERT_GT(drops, 20'000);
        const auto expectUniform = [&](const std::vector<int>& seen, int total, const char* what) {
            const std::vector<double> expected(seen.size(), double(total) / double(seen.size()));
            const ChiSquare chiSquare(seen, expected);
            EXPECT_LT(chiSquare.statistic, chiSquare.limit()) << what << ", class " << s;
        };
        expectUniform(places, drops, "places");
        expectUniform(next, pairs, "a drop and the next");
        for (const auto& seen : size) expectUniform(seen, drops, "place and diameter");
    }
}

// 32 classes, 64 bins of equal probability each; any of them fails by chance once in 10,000, so all together once in
// 300.
TEST(Sizes, EachClassIsATruncatedExponential)
{
    const double slope = DropSizes(25).slope();
    for (int s = 0; s < 32; ++s) {
        const RainField field = rainOf(still, s);
        const SizeClass& c = field.classes()[0];
        std::vector<int> seen(64);
        int drops = 0;
        for (const SeenDrop& drop :
             dropsOf(field.cellsInView(frozenAt(0), everythingTo(8 * field.layers()[densest].cellEdge)))) {
            EXPECT_GE(drop.diameter, c.d0 * (1 - 1e-6));
            EXPECT_LE(drop.diameter, c.d1 * (1 + 1e-6));
            const double u = std::expm1(-slope * (drop.diameter - c.d0)) / std::expm1(-slope * (c.d1 - c.d0));
            ++seen[std::size_t(std::clamp(int(u * 64), 0, 63))];
            ++drops;
        }
        const ChiSquare chiSquare(seen, std::vector<double>(64, drops / 64.0));
        ASSERT_GT(chiSquare.bins, 8) << "class " << s << " has " << drops << " drops";
        EXPECT_LT(chiSquare.statistic, chiSquare.limit()) << "class " << s;
    }
}

// Drops of all classes inside four frustums, about 150,000: their number in each of 60 bins of diameter is Poisson with
// Marshall and Palmer's mean, so the statistic has as many degrees of freedom as bins. Fails by chance once in 10,000.
TEST(Sizes, AllClassesTogetherAreMarshallAndPalmers)
{
    const DropSizes sizes(25);
    const double d0 = rainfall::SizeClassOptions{}.smallestDiameter, d1 = 6e-3, near = 0.1, far = 3.5;
    std::vector<int> seen(60);
    double volume = 0;
    int drops = 0;
    for (const std::uint32_t seed : {1u, 2u, 3u, 4u}) {
        const RainField field = rainOf(stormy, -1, seed);
        const Exposure exposure = frozenAt(12.5);
        volume += frustumVolume(exposure, near, far);
        for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, everythingTo(far, near)))) {
            if (!isInside(drop.open, exposure, near, far)) continue;
            ++drops;
            const double bin = 60 * (drop.diameter - d0) / (d1 - d0);
            if (bin >= 0 && bin < 60) ++seen[std::size_t(bin)];
        }
    }
    std::vector<double> expected;
    for (int i = 0; i < 60; ++i)
        expected.push_back(volume * sizes.numberPerVolume(d0 + (d1 - d0) * i / 60, d0 + (d1 - d0) * (i + 1) / 60));
    const ChiSquare chiSquare(seen, expected);
    ASSERT_GT(drops, 100'000);
    ASSERT_GT(chiSquare.bins, 20);
    EXPECT_LT(chiSquare.statistic, chiSquareLimit(chiSquare.bins));
    EXPECT_NEAR(drops, volume * sizes.numberPerVolume(d0), kNormal1e4 * std::sqrt(drops));
}

// A drop known by its cell's hash and its number falls as the closed form says: nothing else moves it.
TEST(Motions, DropsFollowTheClosedForm)
{
    MotionSettings settings = stormy;
    settings.turbulence = 0;
    const RainField field = rainOf(settings);
    const Visibility visibility = everythingTo(4);
    const auto first = dropsOf(field.cellsInView(frozenAt(10.0), visibility));
    const auto then = byId(dropsOf(field.cellsInView(frozenAt(10.0625), visibility)));
    int met = 0;
    for (const SeenDrop& drop : first) {
        const auto other = then.find(drop.id());
        if (other == then.end()) continue;
        const double speed = field.classOf(drop.dropClass).speed;
        const glm::dvec3 way = field.motion().displacement(speed, 10.0625) - field.motion().displacement(speed, 10.0);
        EXPECT_LT(glm::length(other->second.open - drop.open - way), 1e-5);
        EXPECT_EQ(other->second.diameter, drop.diameter);
        ++met;
    }
    EXPECT_GT(met, 20'000);
}

// Turbulence and a camera that moves included: where a shutter closes, the next one opens.
TEST(Motions, TheNextShutterOpensWhereThisOneCloses)
{
    const RainField field = rainOf(stormy);
    const Visibility visibility = everythingTo(4);
    Exposure now = frozenAt(33.0);
    now.duration_s = 1.0 / 24;
    now.poseAtClose.position = {0.2, 0.1, -0.3};
    Exposure next = frozenAt(33.0 + 1.0 / 24);
    next.poseAtOpen = next.poseAtClose = now.poseAtClose;
    const auto then = byId(dropsOf(field.cellsInView(next, visibility)));
    int met = 0;
    double farthest = 0;
    for (const SeenDrop& drop : dropsOf(field.cellsInView(now, visibility))) {
        const auto other = then.find(drop.id());
        if (other == then.end()) continue;
        farthest = std::max(farthest, glm::length(other->second.open - drop.close));
        ++met;
    }
    EXPECT_GT(met, 20'000);
    EXPECT_LT(farthest, 2e-5);
}

// Velocity of turbulence: drops' ways in 2 ms less their class's, over 40 moments. The waves are longer than drops
// stand apart, so drops of one moment count as few; 40 moments with 4 waves each leave about 3 %.
TEST(Motions, TurbulenceHasTheRmsAskedForOnBothAxes)
{
    MotionSettings settings = still;
    settings.turbulence = 0.8;
    const RainField field = rainOf(settings, 12);
    glm::dvec3 squares(0), sum(0);
    double reach = 0;
    int drops = 0;
    for (int moment = 0; moment < 40; ++moment) {
        Exposure exposure = frozenAt(1.37 * moment);
        exposure.duration_s = 0.002;
        const CellList list = field.cellsInView(exposure, everythingTo(4));
        for (const SeenDrop& drop : dropsOf(list)) {
            const glm::dvec3 own = (drop.close - drop.open - glm::dvec3(list.classes[0].travel)) / exposure.duration_s;
            squares += own * own;
            sum += own;
            reach = std::max(reach, glm::length(drop.close - drop.open - glm::dvec3(list.classes[0].travel)));
            ++drops;
        }
    }
    ASSERT_GT(drops, 10'000);
    EXPECT_NEAR(std::sqrt(squares.x / drops), 0.8, 0.03 * 0.8);
    EXPECT_NEAR(std::sqrt(squares.z / drops), 0.8, 0.03 * 0.8);
    EXPECT_LT(std::sqrt(squares.y / drops), 0.8);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sum[axis] / drops, 0, 0.05);
    EXPECT_LT(reach, 2 * field.motion().turbulenceReach());
}

// A drop that both of two successive frames see must be in both lists, under the same name, where its motion takes it.
// `slack`: a stroke that only touches the border of the picture is left out of the question (rounding).
TEST(Motions, NothingPopsFromFrameToFrame)
{
    const RainField field = rainOf(stormy);
    const Visibility visibility = {.near_m = 0.4, .far_m = 30, .threshold = 0.0003};
    const double fps = 24;
    int kept = 0;
    for (const int frame : {0, 100}) {
        std::array<Exposure, 2> exposures;
        for (int i = 0; i < 2; ++i) {
            exposures[i] = frozenAt((frame + i) / fps, 60, 320, 180);
            exposures[i].duration_s = 1 / fps;
            for (int end = 0; end < 2; ++end) {
                camera::Pose& pose = end == 0 ? exposures[i].poseAtOpen : exposures[i].poseAtClose;
                const double t = (frame + i + end) / fps;
                pose.position = {0.5 * t, 1.6, -2 * t};
                pose.worldFromCamera = camera::rotationZXY(-0.1, 0.4 * t, 0.02);
            }
        }
        const auto first = dropsOf(field.cellsInView(exposures[0], visibility));
        const auto second = dropsOf(field.cellsInView(exposures[1], visibility));
        const auto inFirst = byId(first), inSecond = byId(second);
        const auto check = [&](const std::vector<SeenDrop>& drops, int from, const auto& others, int to) {
            for (const SeenDrop& drop : drops) {
                const double speed = field.classOf(drop.dropClass).speed;
                if (!isVisible(drop, speed, exposures[from], visibility, 0.01)) continue;
                const auto other = others.find(drop.id());
                if (other != others.end()) {
                    const glm::dvec3 gap =
                        from == 0 ? other->second.open - drop.close : other->second.close - drop.open;
                    EXPECT_LT(glm::length(gap), 1e-4);
                    ++kept;
                    continue;
                }
                // Not listed there: then it must be out of sight there. Its other stroke begins where this one ends and
                // goes on like it, to within what gusts and turbulence change in a frame (6 cm at most here).
                SeenDrop moved = drop;
                (from == 0 ? moved.open : moved.close) = from == 0 ? drop.close : drop.open;
                const glm::dvec3 way = field.motion().displacement(speed, exposures[to].open_s + 1 / fps) -
                                       field.motion().displacement(speed, exposures[to].open_s) -
                                       (exposures[to].poseAtClose.position - exposures[to].poseAtOpen.position);
                (from == 0 ? moved.close : moved.open) = from == 0 ? moved.open + way : moved.close - way;
                const double depth = -test::inCamera(exposures[to].poseAtOpen, moved.open).z;
                const double slack = 1 + exposures[to].projection.focal_px * 0.06 / std::max(depth, 0.1);
                Visibility nearer = visibility;
                nearer.near_m += 0.06;
                nearer.far_m -= 0.06;
                nearer.threshold *= 1.1;
                EXPECT_FALSE(isVisible(moved, speed, exposures[to], nearer, slack)) << "at depth " << depth;
            }
        };
        check(first, 0, inSecond, 1);
        check(second, 1, inFirst, 0);
    }
    EXPECT_GT(kept, 2000);
}

// Rain has no favourite frame: the same number of drops, and their places as exact, after 4.8 days of a 24 Hz shot.
TEST(FarFrames, FrameTenMillionIsAsGoodAsFrameOne)
{
    MotionSettings settings = {.wind = {11, -5}, .seed = 4};
    const DropSizes sizes(25);
    const RainField field = rainOf(settings);
    const double near = 0.1, far = 3;
    std::vector<double> numbers;
    for (const std::int64_t frame : {std::int64_t(1), std::int64_t(10'000'000)}) {
        Exposure exposure = frozenAt(double(frame) / 24);
        exposure.poseAtOpen.position = exposure.poseAtClose.position = {123.4, 1.5, -777.7};
        const CellList list = field.cellsInView(exposure, everythingTo(far, near));
        int inside = 0;
        long double worst = 0;
        for (std::size_t n = 0; n < list.cells.size(); ++n) {
            const shared::Cell& cell = list.cells[n];
            const std::size_t s = cell.key.z;
            // The same place in 64-bit mantissas, from whole cell numbers.
            const long double edge = field.layers()[s].cellEdge, t = static_cast<long double>(frame) / 24;
            const std::array<long double, 3> way = {11 * t, -static_cast<long double>(field.classOf(s).speed) * t,
                                                    -5 * t};
            std::array<std::int64_t, 3> index{};
            for (int axis = 0; axis < 3; ++axis) {
                const long double camera = exposure.poseAtOpen.position[axis];
                index[std::size_t(axis)] =
                    std::int64_t(std::llround((cell.origin[axis] + camera - way[std::size_t(axis)]) / edge));
                const long double exact = index[std::size_t(axis)] * edge + way[std::size_t(axis)] - camera;
                worst = std::max(worst, std::abs(exact - cell.origin[axis]));
            }
            ASSERT_EQ(cellHash(7, std::int64_t(s), index[0], index[1], index[2]), cell.key.x | std::uint64_t(cell.key.y)
                                                                                                   << 32);
            for (std::uint32_t i = 0; i < list.dropsIn(n); ++i)
                inside += isInside(test::dropOf(list, cell, i).open, exposure, near, far);
        }
        EXPECT_LT(double(worst), 1e-5) << "frame " << frame;  // [m]
        // Poisson: fails by chance once in 5,000.
        const double expected = frustumVolume(exposure, near, far) * sizes.numberPerVolume(field.classes()[0].d0);
        EXPECT_NEAR(inside, expected, kNormal1e4 * std::sqrt(expected)) << "frame " << frame;
    }
}

TEST(Cameras, SeeTheSameDropsAtTheSamePlaces)
{
    const RainField field = rainOf(stormy);
    Exposure one = frozenAt(5, 70), other = frozenAt(5, 40, 640, 360);
    one.poseAtOpen.position = {100, 2, 50};
    other.poseAtOpen.position = {98.5, 3, 50.5};
    other.poseAtOpen.worldFromCamera = camera::rotationZXY(-0.2, -0.4, 0.3);
    one.poseAtClose = one.poseAtOpen;
    other.poseAtClose = other.poseAtOpen;
    const auto seen = byId(dropsOf(field.cellsInView(one, everythingTo(5))));
    int both = 0;
    for (const SeenDrop& drop : dropsOf(field.cellsInView(other, everythingTo(5)))) {
        const glm::dvec3 world = other.poseAtOpen.position + drop.open;
        const auto found = seen.find(drop.id());
        if (found == seen.end()) {
            // Not listed by the first camera: it must not see that place.
            EXPECT_FALSE(isInside(world - one.poseAtOpen.position, one, 0.1, 5));
            continue;
        }
        EXPECT_LT(glm::length(one.poseAtOpen.position + found->second.open - world), 1e-5);
        EXPECT_EQ(found->second.diameter, drop.diameter);
        ++both;
    }
    EXPECT_GT(both, 1000);
}

TEST(Cameras, AnotherSeedIsAnotherRain)
{
    const auto first = byId(dropsOf(rainOf(still, 10, 1).cellsInView(frozenAt(0), everythingTo(4))));
    for (const SeenDrop& drop : dropsOf(rainOf(still, 10, 2).cellsInView(frozenAt(0), everythingTo(4))))
        EXPECT_EQ(first.count(drop.id()), 0u);
}

struct View {
    const char* name;
    Exposure exposure;
    MotionSettings motion;
    Visibility visibility;
    double aperture = 0, inverseFocus = 0;  // [m], [1/m]
};

std::vector<View> difficultViews()
{
    const auto with = [](double duration, const glm::dvec3& angles_deg, const glm::dvec3& turn_deg = {},
                         const glm::dvec3& way = {}, double fov = 60) {
        Exposure e = frozenAt(7.3, fov, 320, 180);
        e.duration_s = duration;
        e.poseAtOpen.position = {-40.3, 11.1, 900.7};
        const glm::dvec3 a = glm::radians(angles_deg), b = glm::radians(angles_deg + turn_deg);
        e.poseAtOpen.worldFromCamera = camera::rotationZXY(a.x, a.y, a.z);
        e.poseAtClose.worldFromCamera = camera::rotationZXY(b.x, b.y, b.z);
        e.poseAtClose.position = e.poseAtOpen.position + way;
        return e;
    };
    const Visibility usual = {.near_m = 0.3, .far_m = 12, .threshold = 1e-4};
    std::vector<View> views = {
        {"level", with(0.005, {}), still, usual},
        {"rolled", with(0.02, {0, 30, 45}), stormy, usual},
        {"straight down", with(0.02, {-90, 0, 0}), stormy, usual},
        {"pitched up", with(0.02, {75, -120, 200}), stormy, usual},
        {"gale", with(0.04, {0, 10, 0}), {.wind = {40, 25}, .gust = 5, .turbulence = 3, .seed = 2}, usual},
        {"long exposure", with(1.5, {10, 0, 0}), stormy, usual},
        {"panning", with(0.04, {0, 0, 0}, {3, 12, -5}), stormy, usual},
        {"driving", with(0.04, {0, 200, 0}, {}, {0.6, 0.2, 1.3}), stormy, usual},
        {"wide lens", with(0.02, {20, 0, 10}, {}, {}, 140), stormy, {.near_m = 0.3, .far_m = 6, .threshold = 1e-4}},
        {"thinned", with(0.01, {5, 40, 0}), stormy, {.near_m = 0.3, .far_m = 25, .threshold = 1e-4, .thin = 2e-3}},
        {"faint only when near", with(0.02, {5, 0, 0}), stormy, {.near_m = 0.1, .far_m = 100, .threshold = 0.05}},
    };
    View open = {"wide aperture", with(0.01, {0, 0, 20}), stormy, usual, 0.01, 1.0 / 5};
    open.visibility.aperture_m = open.aperture;
    open.visibility.focus_m = 1 / open.inverseFocus;
    views.push_back(open);
    return views;
}

// Every cell of a box around the camera that holds all drops which could show, without any thought of frustums.
TEST(Cameras, ListEveryDropThatShows)
{
    int visible = 0;
    for (const View& view : difficultViews())
        for (const int s : {1, 12, 26, 31}) {
            const RainField field = rainOf(view.motion, s);
            const SizeClass& c = field.classes()[0];
            const CellList list = field.cellsInView(view.exposure, view.visibility);
            const auto listed = byId(dropsOf(list));

            const Exposure& e = view.exposure;
            const glm::dvec3 fallen = field.motion().displacement(c.speed, e.open_s);
            const glm::dvec3 way(list.classes[0].travel);
            const glm::dvec3 cameraInField = e.poseAtOpen.position - fallen;
            const double depth =
                std::min(view.visibility.far_m,
                         double(shared::visibleDepth(float(c.d1), float(c.speed * e.duration_s),
                                                     float(e.projection.focal_px), float(view.visibility.threshold))));
            const double corner = std::hypot(1.0, 0.5 * e.projection.width / e.projection.focal_px + 0.1,
                                             0.5 * e.projection.height / e.projection.focal_px + 0.1);
            const double around = depth * corner + glm::length(way) + field.motion().turbulenceReach() + 0.1;
            std::size_t missed = 0, here = 0;
            for (std::uint32_t layer = 0; layer < field.layers().size(); ++layer) {
                const double edge = field.layers()[layer].cellEdge;
                const auto low = glm::floor((cameraInField - around) / edge),
                           high = glm::floor((cameraInField + around) / edge);
                const PoissonTable poisson(field.numberPerVolume(layer) * edge * edge * edge);
                for (auto k = std::int64_t(low.z); k <= std::int64_t(high.z); ++k)
                    for (auto j = std::int64_t(low.y); j <= std::int64_t(high.y); ++j)
                        for (auto i = std::int64_t(low.x); i <= std::int64_t(high.x); ++i) {
                            const std::uint64_t hash = cellHash(7, layer, i, j, k);
                            const glm::dvec3 at = edge * glm::dvec3(double(i), double(j), double(k));
                            shared::Cell cell;
                            cell.key = {std::uint32_t(hash), std::uint32_t(hash >> 32), layer, 0};
                            cell.origin = glm::vec4(glm::vec3(at - cameraInField), 0);
                            cell.phase = field.motion().turbulencePhases(at, e.open_s, 0);
                            const int count = poisson(unitDouble(mix(hash)));
                            for (int n = 0; n < count; ++n) {
                                const SeenDrop drop = test::dropOf(list, cell, std::uint32_t(n));
                                if (!isVisible(drop, c.speed, e, view.visibility, 0.01, view.aperture,
                                               view.inverseFocus))
                                    continue;
                                ++here;
                                const auto found = listed.find(drop.id());
                                missed += found == listed.end();
                                if (found != listed.end()) {
                                    EXPECT_LT(glm::length(found->second.open - drop.open), 1e-5);
                                }
                            }
                        }
            }
            EXPECT_EQ(missed, 0u) << view.name << ", class " << s << ": of " << here << " visible drops";
            visible += int(here);
        }
    EXPECT_GT(visible, 20'000);
}

TEST(Cameras, BlocksPointAtTheCellOfTheirFirstDrop)
{
    const CellList list = rainOf(stormy).cellsInView(frozenAt(1), everythingTo(3));
    ASSERT_EQ(list.blocks.size(), (list.drops + shared::dropsPerBlock - 1) / shared::dropsPerBlock);
    for (std::size_t block = 0; block < list.blocks.size(); ++block) {
        const std::size_t first = block * shared::dropsPerBlock, cell = list.blocks[block];
        EXPECT_LE(list.cells[cell].key.w, first);
        EXPECT_GT(list.cells[cell].key.w + list.dropsIn(cell), first);
    }
}

// Drops that stand in the frustum within their own visible depth, over six frames: 5,000 to 200,000. Poisson,
// two-sided: fails by chance once in 5,000 a row.
TEST(Strokes, AreAsManyAsExpected)
{
    for (const double threshold : {0.001, 0.004, 0.02}) {
        const RainField field = rainOf(stormy);
        const Visibility visibility = {.near_m = 0.3, .far_m = 25, .threshold = threshold};
        double expected = 0;
        int counted = 0;
        for (int frame = 0; frame < 6; ++frame) {
            Exposure exposure = frozenAt(3.1 * frame, 50, 640, 360);
            exposure.duration_s = 1e-3;
            expected += field.expectedStrokes(exposure.projection, exposure.duration_s, visibility);
            for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, visibility))) {
                const double seen = shared::visibleDepth(
                    float(drop.diameter), float(field.classOf(drop.dropClass).speed * exposure.duration_s),
                    float(exposure.projection.focal_px), float(threshold));
                counted += isInside(drop.open, exposure, visibility.near_m, std::min(visibility.far_m, seen));
            }
        }
        ASSERT_GT(expected, 3000) << threshold;
        EXPECT_NEAR(counted, expected, kNormal1e4 * std::sqrt(expected) + 5e-4 * expected) << threshold;
    }
}

// Drops that are thinned out, in a frustum over six frames, 50 to 500 thousand before: as many as expected, and what
// they cover, 1 / q times as dense, has the sum of squares that all of them have, and q of the sum; the field says what
// is missing. Each check is of a sum of independent terms, whose own scatter is taken for the limit: it fails by chance
// once in 5,000.
TEST(Thinning, KeepsVarianceAndSaysWhatIsMissingOfTheMean)
{
    const RainField field = rainOf(still);
    for (const double thin : {0.004, 0.02, 0.1}) {
        const Visibility all = {.near_m = 2, .far_m = 25, .threshold = 0.001};
        Visibility thinned = all;
        thinned.thin = thin;
        double expected = 0, missing = 0, kept = 0, fullSum = 0, fullSquares = 0, sum = 0, squares = 0, scatter = 0,
               scatterOfSquares = 0;
        int counted = 0;
        for (int frame = 0; frame < 6; ++frame) {
            Exposure exposure = frozenAt(3.1 * frame, 50, 640, 360);
            exposure.duration_s = 1e-3;
            const double focal = exposure.projection.focal_px, pixels = 640.0 * 360.0;
            expected += field.expectedStrokes(exposure.projection, exposure.duration_s, thinned);
            missing += pixels * field.thinnedOpticalDepth(25, focal, exposure.duration_s, thinned);
            // Terms: what a drop covers, in pixels; for the squares, times its opacity.
            const auto add = [&](const SeenDrop& drop, bool isThinned) {
                const double speed = field.classOf(drop.dropClass).speed, depth = test::depthOf(drop, exposure);
                const double seen = shared::visibleDepth(float(drop.diameter), float(speed * exposure.duration_s),
                                                         float(focal), 0.001f);
                if (!isInside(drop.open, exposure, 2, std::min(25.0, seen))) return;
                const double q = test::drawnShareOf(drop, speed, exposure, thinned),
                             width = focal * drop.diameter / depth;
                const double covers = pi / 4 * width * width, opacity = covers / (1 + focal * speed * 1e-3 / depth);
                if (!isThinned) {
                    fullSum += covers;
                    fullSquares += covers * opacity;
                    kept += q * covers;
                } else if (drop.rank < q * q) {
                    ++counted;
                    sum += covers / q;
                    squares += covers * opacity / (q * q);
                    // Variance of a drop's term given that it may be drawn: its expected square, less the square.
                    scatter += covers * covers * (1 - q * q) / (q * q);
                    scatterOfSquares += std::pow(covers * opacity, 2) * (1 - q * q) / std::pow(q, 4);
                }
            };
            for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, all))) add(drop, false);
            for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, thinned))) add(drop, true);
        }
        ASSERT_GT(counted, 1500) << thin;
        EXPECT_NEAR(counted, expected, kNormal1e4 * std::sqrt(expected) + 5e-4 * expected) << thin;
        EXPECT_NEAR(squares, fullSquares, kNormal1e4 * std::sqrt(scatterOfSquares)) << thin;
        EXPECT_LT(kNormal1e4 * std::sqrt(scatterOfSquares), 0.1 * fullSquares);
        EXPECT_NEAR(sum, kept, kNormal1e4 * std::sqrt(scatter)) << thin;
        EXPECT_NEAR((fullSum - kept) / missing, 1, 0.03) << thin;
    }
}

TEST(Thinning, DrawsTheSameDropsOrNone)
{
    const RainField field = rainOf(stormy);
    Exposure exposure = frozenAt(5, 70);
    exposure.duration_s = 0.005;
    const Visibility all = {.near_m = 0.3, .far_m = 10, .threshold = 1e-3};
    Visibility thinned = all;
    thinned.thin = 0.02;
    const auto whole = byId(dropsOf(field.cellsInView(exposure, all)));
    std::size_t drawn = 0;
    for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, thinned))) {
        const auto found = whole.find(drop.id());
        ASSERT_NE(found, whole.end());
        EXPECT_EQ(found->second.open, drop.open);
        EXPECT_EQ(found->second.rank, drop.rank);
        ++drawn;
    }
    EXPECT_LT(drawn, whole.size() / 2);
    EXPECT_GT(drawn, 500u);
}

// What lies over a pixel of the strokes that are thinned out, from the drops themselves. 2 %: footprints are taken as
// one pixel wide and as long as the way and a pixel.
TEST(Thinning, OverlapIsWhatTheDropsHave)
{
    const RainField field = rainOf(still);
    const Visibility visibility = {.near_m = 0.3, .far_m = 25, .threshold = 4e-4, .thin = 4e-3};
    double covered = 0;
    for (int frame = 0; frame < 4; ++frame) {
        Exposure exposure = frozenAt(3.1 * frame, 50, 640, 360);
        exposure.duration_s = 4e-3;
        const double focal = exposure.projection.focal_px;
        for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, visibility))) {
            const double speed = field.classOf(drop.dropClass).speed,
                         depth = -test::inCamera(exposure.poseAtOpen, drop.open).z;
            const double q = double(shared::drawnShare(float(depth), float(drop.diameter),
                                                       float(speed * exposure.duration_s), float(focal), 4e-3f));
            const double seen =
                shared::visibleDepth(float(drop.diameter), float(speed * exposure.duration_s), float(focal), 4e-4f);
            if (q < 1 && drop.rank < q * q && isInside(drop.open, exposure, 0.3, std::min(25.0, seen)))
                covered += focal * speed * exposure.duration_s / depth + 1;
        }
    }
    EXPECT_NEAR(covered / (4 * 640 * 360) /
                    field.thinnedOverlap(frozenAt(0, 50, 640, 360).projection.focal_px, 4e-3, visibility),
                1, 0.02);
}

TEST(Thinning, StopsWhereStrokesNoLongerOverlap)
{
    const RainField field = rainOf(still);
    const Visibility visibility = {.near_m = 0.3, .far_m = 100, .threshold = 1e-3, .thin = 0.03};
    double before = 0;
    for (const double focal : {60.0, 300.0, 1500.0, 20000.0}) {
        Visibility used = visibility;
        used.thin = field.thinnableTo(focal, 0.005, visibility);
        EXPECT_GE(used.thin, std::max(before, visibility.threshold));
        EXPECT_LE(used.thin, visibility.thin);
        before = used.thin;
        if (used.thin > visibility.threshold)
            EXPECT_GE(field.thinnedOverlap(focal, 0.005, used), RainField::leastOverlap);
        else
            EXPECT_LT(field.thinnedOverlap(focal, 0.005, visibility), RainField::leastOverlap);
    }
    EXPECT_EQ(field.thinnableTo(60, 0.005, visibility), visibility.threshold);
    EXPECT_EQ(field.thinnableTo(20000, 0.005, visibility), visibility.thin);
    EXPECT_EQ(field.thinnableTo(20000, 0.005, {.threshold = 1e-3, .thin = 0}), 0);
}

TEST(Thinning, Limits)
{
    const RainField field = rainOf(still);
    const auto missing = [&](double thin, double depth) {
        return field.thinnedOpticalDepth(depth, 1000, 0.005,
                                         {.near_m = 0.3, .far_m = 80, .threshold = 1e-3, .thin = thin});
    };
    EXPECT_EQ(missing(0, 50), 0);
    EXPECT_EQ(missing(1e-3, 50), 0);
    EXPECT_EQ(missing(0.1, 0.3), 0);
    EXPECT_EQ(missing(0.1, 80), missing(0.1, std::numeric_limits<double>::infinity()));
    double before = 0;
    for (const double thin : {2e-3, 0.01, 0.1, 1.0}) {
        EXPECT_GT(missing(thin, 50), before);
        before = missing(thin, 50);
    }
    // Everything thinned out to nothing: what strokes would have drawn is all that is drawn otherwise.
    const Visibility drawn = {.near_m = 0.3, .far_m = 80, .threshold = 1e-3};
    const double all = DropSizes(25).extinction(1.0);
    EXPECT_NEAR((missing(1e9, 50) + field.undrawnOpticalDepth(50, 1000, 0.005, drawn, all)) / (49.7 * all), 1, 0.01);
    for (const float thin : {0.0f, 1e-3f, 0.5f})
        for (const float depth : {0.1f, 3.0f, 1e4f}) {
            const float q = shared::drawnShare(depth, 1e-3f, 0.04f, 1000, thin);
            EXPECT_GT(q, 0);
            EXPECT_LE(q, 1);
            EXPECT_TRUE(thin > 0 || q == 1);
        }
}

TEST(Strokes, VisibleDepthIsWhereTheStrokeReachesTheThreshold)
{
    for (const double diameter : {3e-4, 1e-3, 5e-3})
        for (const double path : {0.0, 0.02, 3.0})
            for (const double threshold : {1e-6, 0.002, 0.3}) {
                const double f = 900;
                const double z = shared::visibleDepth(float(diameter), float(path), float(f), float(threshold));
                const double alpha = pi / 4 * f * f * diameter * diameter / (z * (f * path + z));
                EXPECT_NEAR(alpha / threshold, 1, 1e-5) << diameter << " " << path;
            }
}

// Drawn and undrawn drops are all drops, whatever the threshold. Drawn: the integral over diameters of each drop's
// shadow out to its visible depth, by 400 midpoints a class.
TEST(Extinction, DrawnAndUndrawnAddUpWhateverTheThreshold)
{
    const DropSizes sizes(25);
    const RainField field = rainOf(still);
    const double focal = 1000, exposure = 0.005, all = sizes.extinction(1.0);
    for (const double depth : {3.0, 30.0, 150.0})
        for (const double threshold : {1e-9, 1e-4, 0.002, 0.02, 0.3, 1e9}) {
            const Visibility visibility = {.near_m = 1e-9, .far_m = 200, .threshold = threshold};
            double drawn = 0;
            for (const SizeClass& c : field.classes())
                for (int i = 0; i < 400; ++i) {
                    const double a = c.d0 + (c.d1 - c.d0) * i / 400, b = c.d0 + (c.d1 - c.d0) * (i + 1) / 400;
                    const double seen = shared::visibleDepth(float(0.5 * (a + b)), float(c.speed * exposure),
                                                             float(focal), float(threshold));
                    drawn += sizes.extinction(1.0, a, b) * std::min(seen, depth);
                }
            const double undrawn = field.undrawnOpticalDepth(depth, focal, exposure, visibility, all);
            EXPECT_NEAR((drawn + undrawn) / (all * depth), 1, 2e-3) << depth << " m, threshold " << threshold;
        }
}

TEST(Extinction, Limits)
{
    const DropSizes sizes(25);
    const RainField field = rainOf(still);
    const double all = sizes.extinction(1.0);
    const auto undrawn = [&](double depth, double threshold) {
        return field.undrawnOpticalDepth(depth, 1000, 0.005, {.near_m = 0.3, .far_m = 80, .threshold = threshold}, all);
    };
    // Nothing drawn: all drops are fog. Everything drawn: only those under the smallest class are.
    EXPECT_NEAR(undrawn(50, 1e9) / (50 * all), 1, 1e-6);
    EXPECT_NEAR(undrawn(50, 1e-12) / (50 * sizes.extinction(1.0, 0, field.classes()[0].d0)), 1, 1e-3);
    // No rain, no fog beyond far.
    EXPECT_EQ(undrawn(80, 0.01), undrawn(1e9, 0.01));
    EXPECT_EQ(undrawn(80, 0.01), undrawn(std::numeric_limits<double>::infinity(), 0.01));
    EXPECT_EQ(undrawn(0, 0.01), 0);
    double before = 0;
    for (const double threshold : {1e-4, 1e-3, 1e-2, 0.1, 1.0}) {
        EXPECT_GT(undrawn(50, threshold), before);
        before = undrawn(50, threshold);
    }
    const RainField denser(field.classes(), sizes.slope(), Motion(still), 7, 3.0);
    const Visibility visibility = {.near_m = 0.3, .far_m = 80, .threshold = 0.01};
    EXPECT_NEAR(denser.undrawnOpticalDepth(50, 1000, 0.005, visibility, all) /
                    field.undrawnOpticalDepth(50, 1000, 0.005, visibility, all),
                3, 1e-9);
    EXPECT_NEAR(denser.expectedStrokes(frozenAt(0).projection, 0.005, visibility) /
                    field.expectedStrokes(frozenAt(0).projection, 0.005, visibility),
                3, 1e-9);
}

// The same from the drops themselves: what a lower threshold draws more covers as much of the picture as it takes from
// the fog. Drops from 2 m on, so that no single one counts for much: 10 frames hold it to 2 %.
TEST(Extinction, WhatIsDrawnCoversWhatIsMissingInTheFog)
{
    const RainField field = rainOf(still);
    const double all = DropSizes(25).extinction(1.0), far = 18, duration = 0.005;
    const auto limits = [&](double threshold) { return Visibility{.near_m = 2, .far_m = far, .threshold = threshold}; };
    double covered = 0;
    constexpr int frames = 10;
    Exposure exposure = frozenAt(0, 50, 480, 270);
    exposure.duration_s = duration;
    const double focal = exposure.projection.focal_px;
    for (int frame = 0; frame < frames; ++frame) {
        exposure.open_s = 2.7 * frame;
        for (const SeenDrop& drop : dropsOf(field.cellsInView(exposure, limits(0.0003)))) {
            const auto seen = [&](double threshold) {
                return double(shared::visibleDepth(float(drop.diameter),
                                                   float(field.classOf(drop.dropClass).speed * duration), float(focal),
                                                   float(threshold)));
            };
            const double depth = -test::inCamera(exposure.poseAtOpen, drop.open).z;
            if (!isInside(drop.open, exposure, 2, far) || depth > seen(0.0003) || depth <= std::max(2.0, seen(0.003)))
                continue;
            const double width = focal * drop.diameter / depth;
            covered += pi / 4 * width * width;
        }
    }
    covered /= frames * 480.0 * 270.0;
    const double missing = field.undrawnOpticalDepth(far, focal, duration, limits(0.003), all) -
                           field.undrawnOpticalDepth(far, focal, duration, limits(0.0003), all);

    EXPECT_NEAR(covered / missing, 1, 0.02) << covered << " of " << missing;
}

// What no machine has the time or the memory for is a sentence, before either is spent.
TEST(Cells, RefuseToBeTooMany)
{
    const RainField field = rainOf(still);
    const auto sentence = [&](const Exposure& exposure, const Visibility& visibility) {
        return virga::test::sentenceOf(ErrorCode::InvalidArgument, [&] { field.cellsInView(exposure, visibility); });
    };
    EXPECT_SAYS(sentence(frozenAt(0), everythingTo(1e6)), "over 1e+09 cells");
    EXPECT_SAYS(sentence(frozenAt(0), everythingTo(200)), "over 30000000 drops may cross the picture");
    EXPECT_SAYS(sentence(frozenAt(1e18), everythingTo(1)), "too far from where they began");
    Exposure away = frozenAt(0);
    away.poseAtOpen.position = away.poseAtClose.position = {0, 1e20, 0};
    EXPECT_SAYS(sentence(away, everythingTo(1)), "too far from where they began");
    Exposure fast = frozenAt(0);
    fast.duration_s = 60;
    fast.poseAtClose.position = {1e7, 0, 0};
    EXPECT_SAYS(sentence(fast, everythingTo(1)), "shorten the exposure");
    // And what is far, fast and long, but not too much, is listed.
    EXPECT_GT(field.cellsInView(frozenAt(1e12), everythingTo(5)).drops, 1000u);
}

}  // namespace
}  // namespace virga::particles
