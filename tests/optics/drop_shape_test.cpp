#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "optics/DropShape.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;

// The reference has the shapes of the printed coefficients, and by what r must be multiplied to keep the volume.
TEST(DropShape, AgreesWithTheReferenceNumbers)
{
    const auto data = nlohmann::json::parse(std::ifstream(VIRGA_TEST_DATA "/microphysics.json"));
    ASSERT_EQ(data["shapes"].size(), 4u);
    for (const auto& r : data["shapes"]) {
        const auto value = [&](const char* name) { return r[name].get<double>(); };
        const DropShape shape(1e-3 * value("radius_undistorted_mm"));
        const double factor = value("factor_to_conserve_volume");
        EXPECT_NEAR(1e3 * shape.radius(0.0), factor * value("r_bottom_mm"), 1e-12);
        EXPECT_NEAR(1e3 * shape.radius(pi), factor * value("r_top_mm"), 1e-12);
        EXPECT_NEAR(1e3 * shape.width(), factor * value("width_mm"), 1e-12);
        EXPECT_NEAR(1e3 * shape.height(), factor * value("height_mm"), 1e-12);
        EXPECT_NEAR(shape.axisRatio(), value("axis_ratio_height_over_width"), 1e-12);
        EXPECT_NEAR(1e9 * shape.volume(), value("sphere_volume_mm3"), 1e-12 * value("sphere_volume_mm3"));
        EXPECT_NEAR(1e9 * shape.volume() * value("volume_over_sphere"), value("volume_mm3"),
                    1e-12 * value("volume_mm3"));
        EXPECT_NEAR(meanAxisRatio(2e-3 * value("radius_undistorted_mm")),
                    value("mean_r_axis_ratio_Pruppacher_Beard_1.03-0.062D"), 1e-12);
    }
}

TEST(DropShape, KeepsItsVolume)
{
    const GaussLegendre rule(40);
    for (double radius_mm = 0.05; radius_mm < 6.0; radius_mm += 0.173) {
        const DropShape shape(1e-3 * radius_mm);
        double volume = 0.0;
        for (std::size_t i = 0; i < rule.node.size(); ++i) {
            volume += 2.0 * pi / 3.0 * rule.weight[i] * std::pow(shape.radius(std::acos(rule.node[i])), 3);
        }
        EXPECT_NEAR(volume / (4.0 / 3.0 * pi * std::pow(1e-3 * radius_mm, 3)), 1.0, 1e-12);
        EXPECT_NEAR(shape.volume() / volume, 1.0, 1e-12);
    }
}

TEST(DropShape, FlattensAsItGrows)
{
    double before = 1.0;
    for (double diameter = 0.1e-3; diameter <= 9e-3; diameter += 0.1e-3) {
        const double ratio = DropShape(0.5 * diameter).axisRatio();
        EXPECT_LT(ratio, before) << diameter;
        before = ratio;
        EXPECT_NEAR(ratio, meanAxisRatio(diameter), 0.045) << diameter;
    }
    EXPECT_NEAR(DropShape(1e-6).axisRatio(), 1.0, 1e-6);
    EXPECT_NEAR(DropShape(6e-3).axisRatio(), DropShape(4.5e-3).axisRatio(), 1e-12);
    EXPECT_EQ(DropShape(0.0).volume(), 0.0);
}

}  // namespace
}  // namespace virga::optics
