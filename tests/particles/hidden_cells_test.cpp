#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <limits>
#include <random>

#include "Drops.h"
#include "particles/HiddenCells.h"
#include "rainfall/DropSizes.h"

namespace virga::particles {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

ImageF noiseOf(int width, int height, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> depth(0.5f, 50);
    ImageF image(width, height, 1);
    for (float& value : image.values()) value = random() % 50 == 0 ? infinity : depth(random);
    return image;
}

// Never less than the farthest pixel in the box, and never more than that of the box with as much around it.
TEST(FarthestDepth, IsThatOfTheBoxAndLittleMore)
{
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}, {131, 77}}) {
        const ImageF depth = noiseOf(width, height, 5);
        const FarthestDepth farthest(depth);
        std::mt19937 random(9);
        std::uniform_real_distribution<double> place(-20, 150);
        for (int i = 0; i < 3000; ++i) {
            double x0 = place(random), x1 = place(random), y0 = place(random), y1 = place(random);
            if (x1 < x0) std::swap(x0, x1);
            if (y1 < y0) std::swap(y0, y1);
            // Two tiles of a level cover the box, so that they are no wider than twice it.
            const double around = 2 * std::max({x1 - x0, y1 - y0, double(FarthestDepth::tile)});
            float least = 0, most = 0;
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    if (x + 1 >= x0 && x < x1 && y + 1 >= y0 && y < y1) least = std::max(least, depth.at(x, y));
                    if (x + 1 >= x0 - around && x < x1 + around && y + 1 >= y0 - around && y < y1 + around)
                        most = std::max(most, depth.at(x, y));
                }
            const float found = farthest.in(x0, y0, x1, y1);
            ASSERT_GE(found, least);
            ASSERT_LE(found, most) << width << "x" << height << ": " << x0 << " " << y0 << " " << x1 << " " << y1;
        }
        EXPECT_EQ(farthest.in(width + 1, 0, width + 9, 9), 0);
        EXPECT_EQ(farthest.in(-9, 0, -1, 9), 0);
        EXPECT_EQ(farthest.in(-1e300, -1e300, 1e300, 1e300),
                  *std::max_element(depth.values().begin(), depth.values().end()));
    }
}

struct Scene {
    const char* name;
    double turn_deg;  // of the camera while the shutter is open
    glm::dvec3 way;   // of the camera [m]
    double aperture_m;
    double duration_s;
};

// Every drop that is left out lies behind the depth at every pixel that its stroke touches.
TEST(HiddenCells, LeaveOutOnlyWhatIsBehindTheDepth)
{
    const rainfall::DropSizes sizes(25);
    const Motion motion({.wind = {3, -1}, .gust = 0.5, .turbulence = 0.4, .seed = 3});
    const RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(), motion, 7);
    for (const Scene& scene : {Scene{"still", 0, {0, 0, 0}, 0.0, 0.005}, Scene{"pan", 4, {0, 0, 0}, 0.003, 0.02},
                               Scene{"dolly", 0, {0.1, 0, -0.3}, 0.05, 0.02}}) {
        Exposure exposure;
        exposure.open_s = 11;
        exposure.duration_s = scene.duration_s;
        exposure.projection = camera::projectionFromHorizontalFov(160, 90, glm::radians(60.0));
        exposure.poseAtClose.position = scene.way;
        exposure.poseAtClose.worldFromCamera = camera::rotationZXY(0, glm::radians(scene.turn_deg), 0);
        // A wall at 3 m, a door in it through which the sky is seen, and a low step before it.
        ImageF depth(160, 90, 1, 3.0f);
        for (int y = 30; y < 70; ++y)
            for (int x = 70; x < 90; ++x) depth.at(x, y) = infinity;
        for (int y = 80; y < 90; ++y)
            for (int x = 0; x < 160; ++x) depth.at(x, y) = 1.7f;
        const FarthestDepth farthest(depth);
        const double focal = exposure.projection.focal_px, focus = 0.2;
        const HiddenCells hidden(farthest, {.leastFocal_px = focal,
                                            .greatestFocal_px = focal,
                                            .axisX_px = 80,
                                            .axisY_px = 45,
                                            .aperture_m = scene.aperture_m,
                                            .inverseFocus_1_m = focus,
                                            .near_m = 0.5,
                                            .matteWidthDiameters = 1.25});
        Visibility visibility = {.near_m = 0.5, .far_m = 12, .threshold = 1e-4};
        const CellList all = field.cellsInView(exposure, visibility);
        visibility.hidden = &hidden;
        const CellList seen = field.cellsInView(exposure, visibility);
        EXPECT_EQ(all.hiddenCells, 0u);
        EXPECT_GT(seen.hiddenCells, all.cells.size() / 3) << scene.name;

        const auto kept = test::byId(test::dropsOf(seen));
        std::size_t checked = 0;
        for (const test::SeenDrop& drop : test::dropsOf(all)) {
            if (kept.contains(drop.id())) continue;
            const double speed = field.classOf(drop.dropClass).speed;
            if (!test::isVisible(drop, speed, exposure, visibility, 0, scene.aperture_m, focus)) continue;
            ++checked;
            const glm::dvec3 open = test::inCamera(exposure.poseAtOpen, drop.open);
            const glm::dvec3 close = test::inCamera(exposure.poseAtClose, drop.close);
            const double nearest = std::min(-open.z, -close.z), mean = -0.5 * (open.z + close.z);
            const glm::dvec2 a = camera::project(exposure.projection, open).px,
                             b = camera::project(exposure.projection, close).px;
            const double half = 0.5 * std::hypot(focal * drop.diameter / nearest,
                                                 focal * scene.aperture_m * std::abs(1 / mean - focus));
            const int steps = 2 + int(2 * glm::distance(a, b));
            for (int i = 0; i <= steps; ++i) {
                const glm::dvec2 at = glm::mix(a, b, double(i) / steps);
                for (int y = int(std::floor(at.y - half)); y <= int(std::floor(at.y + half)); ++y)
                    for (int x = int(std::floor(at.x - half)); x <= int(std::floor(at.x + half)); ++x)
                        if (x >= 0 && x < 160 && y >= 0 && y < 90) {
                            ASSERT_GT(nearest, double(depth.at(x, y))) << scene.name << " " << x << " " << y;
                        }
            }
        }
        EXPECT_GT(checked, 1000u) << scene.name;
    }
}

TEST(HiddenCells, NothingIsHiddenBeforeTheDepthOrUnderTheSky)
{
    const ImageF wall(64, 48, 1, 5.0f), sky(64, 48, 1, infinity);
    const FarthestDepth behindWall(wall), behindSky(sky);
    const StrokeLens lens = {
        .leastFocal_px = 50, .greatestFocal_px = 50, .axisX_px = 32, .axisY_px = 24, .near_m = 0.5};
    const auto hides = [&](const FarthestDepth& depth, double z, double radius) {
        return HiddenCells(depth, lens).hides({0, 0, -z}, {0, 0, -z}, radius, 2e-3);
    };
    EXPECT_TRUE(hides(behindWall, 7, 1.9));
    EXPECT_FALSE(hides(behindWall, 7, 2.1));
    EXPECT_FALSE(hides(behindWall, 3, 0.1));
    EXPECT_FALSE(hides(behindSky, 1e9, 1));
    EXPECT_FALSE(hides(behindWall, -7, 1)) << "behind the camera";
    EXPECT_FALSE(HiddenCells(behindWall, lens).hides({0, 0, -7}, {0, 0, -3}, 1, 2e-3)) << "comes out from behind it";
}

}  // namespace
}  // namespace virga::particles
