#include <gtest/gtest.h>

#include "optics/DropOscillation.h"

namespace virga::optics {
namespace {

// Diameter [mm], modes 2 and 3 [Hz], computed independently and rounded to 1 Hz.
TEST(DropOscillation, RayleighsFrequencies)
{
    constexpr double table[][3] = {{1, 344, 666}, {1.5, 187, 362}, {2, 122, 235}, {3, 66, 128}, {5, 31, 60}};
    for (const auto& [diameter_mm, second, third] : table) {
        EXPECT_NEAR(oscillationFrequency(2, 1e-3 * diameter_mm), second, 0.6) << diameter_mm;
        EXPECT_NEAR(oscillationFrequency(3, 1e-3 * diameter_mm), third, 0.6) << diameter_mm;
    }
}

TEST(DropOscillation, MovingAsAWholeIsNoOscillation) { EXPECT_EQ(oscillationFrequency(1, 1e-3), 0.0); }

TEST(DropOscillation, SmallDropsSettleSooner)
{
    // 2 mm: 5 nu / r^2 = 5.02 /s.
    EXPECT_NEAR(oscillationDamping(2, 2e-3), 5.02, 1e-3);
    EXPECT_GT(oscillationDamping(2, 1e-3), oscillationDamping(2, 2e-3));
    EXPECT_GT(oscillationDamping(3, 1e-3), oscillationDamping(2, 1e-3));
}

}  // namespace
}  // namespace virga::optics
