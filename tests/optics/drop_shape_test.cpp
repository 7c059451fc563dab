#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "optics/DropShape.h"
#include "optics/GaussLegendre.h"

namespace virga::optics {
namespace {

constexpr double pi = std::numbers::pi;

struct Reference {
    double radius_mm, bottom_mm, top_mm, width_mm, height_mm, axisRatio, volumeFactor;
};

// Computed independently from the printed coefficients; volumeFactor is what r must be multiplied by to keep the
// volume.
constexpr Reference reference[] = {
    {0.5, 0.49185, 0.49685, 1.0051102714466351, 0.9887, 0.9836731631216781, 0.9999896730562642},
    {1.0, 0.9277, 0.9683, 2.047825410871813, 1.896, 0.9258601782819088, 0.9999724512571954},
    {3.0, 2.0421, 2.3973, 6.926376455395372, 4.4394, 0.6409411946620205, 0.9998967456004664},
    {4.5, 2.6829, 3.0303, 11.174206779324694, 5.7132, 0.5112846140068722, 1.0003938959520502},
};

TEST(DropShape, AgreesWithTheReferenceNumbers)
{
    for (const Reference& r : reference) {
        const DropShape shape(1e-3 * r.radius_mm);
        EXPECT_NEAR(1e3 * shape.radius(0.0), r.bottom_mm * r.volumeFactor, 1e-9);
        EXPECT_NEAR(1e3 * shape.radius(pi), r.top_mm * r.volumeFactor, 1e-9);
        EXPECT_NEAR(1e3 * shape.width(), r.width_mm * r.volumeFactor, 1e-6);
        EXPECT_NEAR(1e3 * shape.height(), r.height_mm * r.volumeFactor, 1e-6);
        EXPECT_NEAR(shape.axisRatio(), r.axisRatio, 1e-7);
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
