// Shots that come and go leave nothing behind.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "stress/Run.h"
#include "stress/Worst.h"

namespace virga::stress {
namespace {

/// Resident memory [bytes].
double memoryInUse()
{
    std::ifstream file("/proc/self/statm");
    double pages = 0;
    file >> pages >> pages;
    return pages * double(sysconf(_SC_PAGESIZE));
}

/// What a shot adds to it [bytes], once caches are full.
double leftByAShot(const std::string& device)
{
    Worst worst;
    worst.device = device;
    worst.shot.width = 320;
    worst.shot.height = 180;
    worst.settings.ground = "1.7,10";
    worst.settings.strokes = 3000;
    worst.settings.blur_px = 2;
    const auto shots = [&](int count) {
        for (int i = 0; i < count; ++i) worst.render();
        return memoryInUse();
    };
    // Caches fill at first. A shot of this size has 20 MB of pictures and 1 MB of settings, tables and programs.
    const double before = shots(5), after = shots(20);
    return (after - before) / 20;
}

TEST(Memory, ShotsLeaveNoneBehind) { EXPECT_LT(leftByAShot("cpu"), 0.5e6) << "bytes a shot"; }

TEST(Memory, ShotsThroughShadersLeaveNoneBehind)
{
    const auto device = shaderDevice();
    if (!device) GTEST_SKIP() << "no OpenGL device";
    EXPECT_LT(leftByAShot(*device), 1e6) << "bytes a shot";
}

}  // namespace
}  // namespace virga::stress
