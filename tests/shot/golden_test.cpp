// Few small pictures, kept as they once were looked at and found good. They hold the look where laws are silent: a
// change of a profile, a matte, a splash. Rendered on Mesa's software renderer; machines and compilers may differ by
// rounding, so a share of the pixels may be off by a little.
//
// To accept a change: VIRGA_UPDATE_GOLDEN=1 build/test/bin/test_shot --gtest_filter='Golden.*', look at the new files
// beside the old ones, and commit them on their own with the reason.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "io/Plate.h"
#include "shot/Compositor.h"

namespace virga::shot {
namespace {

constexpr int width = 256, height = 144;

// Thresholds after OpenImageIO's testsuite: what a pixel may be off, the share that may be off by more, and what none
// may.
constexpr float small = 0.002f, never = 0.05f;
constexpr double mayBeOff = 0.002;

/// Dusk over a road: a sky that brightens upwards, a dark wall on the left, a grey road.
ImageF plate()
{
    ImageF image(width, height, 4, 1.0f);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool wall = x < 96 && y < 100, sky = y < 64 && !wall;
            const float light = sky ? 0.9f - 0.006f * float(y) : wall ? 0.02f : 0.08f + 0.001f * float(y - 64);
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = light * (1 + 0.05f * float(c - 1));
        }
    return image;
}

void expectLikeGolden(const char* name, const Settings& settings)
{
    Compositor compositor(settings, {width, height, 24, 0}, {.wanted = {}, .device = "cpu", .shaderFolder = {}}, {});
    io::PlateFrame frame;
    frame.number = 11;
    frame.pixels = plate();
    const ImageF picture = compositor.render(std::move(frame)).beauty;

    const std::string path = std::string(VIRGA_TEST_DATA) + "/golden/" + name + ".exr";
    if (std::getenv("VIRGA_UPDATE_GOLDEN") != nullptr) {
        io::writeExr(path, picture, {"R", "G", "B", "A"}, true);
        GTEST_SKIP() << "wrote " << path;
    }
    const io::RawImage golden = io::readRawImage(path);
    ASSERT_EQ(golden.pixels.width(), width);
    ASSERT_EQ(golden.pixels.height(), height);
    std::size_t off = 0;
    float most = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 4; ++c) {
                const float difference = std::abs(golden.pixels.at(x, y, c) - picture.at(x, y, c));
                off += difference > small;
                most = std::max(most, difference);
            }
    EXPECT_LE(double(off), mayBeOff * width * height * 4) << name << ": " << off << " values are off by over " << small;
    EXPECT_LE(most, never) << name;
}

TEST(Golden, RainBeforeWallAndSky)
{
    Settings s;
    s.rate_mm_h = 60;
    s.wind_m_s = {1.5, 0};
    expectLikeGolden("rain", s);
}

TEST(Golden, RainAndSplashesOverARoad)
{
    Settings s;
    s.rate_mm_h = 80;
    s.ground = "1.2,2";
    s.exposure_s = 1.0 / 60;
    expectLikeGolden("road", s);
}

}  // namespace
}  // namespace virga::shot
