// What shots share, counted; devices that are not there; memory that does not grow.
#include <malloc.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <random>

#include "Caller.h"

namespace virga::test {
namespace {

/// OpenGL by Mesa's software renderer, whose number EGL decides; empty where there is none.
std::string softwareDevice()
{
    for (const char* number : {"0", "1", "2", "3", "4", "5", "6", "7", "8", "9"}) {
        const ShotPointer shot = smallShot(16, 16, number);
        Frame plate(16, 16), beauty(16, 16);
        paint(plate);
        const char* device = nullptr;
        if (render(shot.get(), 0, plate, beauty) == VIRGA_OK && virga_shot_device(shot.get(), &device) == VIRGA_OK &&
            std::string(device).find("llvmpipe") == 0)
            return number;
    }
    return "";
}

class Sharing : public testing::Test {
protected:
    Sharing() : plate(64, 48), beauty(64, 48), again(64, 48) { paint(plate); }
    static std::string deviceOf(const ShotPointer& shot)
    {
        const char* text = nullptr;
        EXPECT_EQ(virga_shot_device(shot.get(), &text), VIRGA_OK);
        return text;
    }
    Frame plate, beauty, again;
};

TEST_F(Sharing, ASecondShotOpensNoDeviceAndCompilesNothing)
{
    const std::string device = softwareDevice();
    if (device.empty()) GTEST_SKIP() << "no software device for OpenGL";
    const ShotPointer first = smallShot(64, 48, device.c_str());
    ASSERT_EQ(render(first.get(), 1, plate, beauty), VIRGA_OK) << virga_error_sentence();
    const std::uint64_t contexts = count("contexts"), programs = count("programs"), frames = count("frames");
    const ShotPointer second = smallShot(64, 48, device.c_str()), third = smallShot(20, 10, device.c_str());
    ASSERT_EQ(render(second.get(), 1, plate, again), VIRGA_OK);
    EXPECT_EQ(again.planes(), beauty.planes());
    Frame small(20, 10), result(20, 10);
    paint(small);
    ASSERT_EQ(render(third.get(), 1, small, result), VIRGA_OK);
    EXPECT_EQ(count("contexts"), contexts);
    EXPECT_EQ(count("programs"), programs);
    EXPECT_EQ(count("frames"), frames + 2);
    // In turn, each with its own buffers.
    ASSERT_EQ(render(first.get(), 1, plate, again), VIRGA_OK);
    EXPECT_EQ(again.planes(), beauty.planes());
}

TEST_F(Sharing, AChangeOfAParameterCompilesNothing)
{
    const std::string device = softwareDevice();
    if (device.empty()) GTEST_SKIP() << "no software device for OpenGL";
    const ShotPointer shot = smallShot(64, 48, device.c_str());
    virga_shot_set(shot.get(), "splashes", "1");
    virga_shot_set(shot.get(), "ground", "1.6");
    ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK);
    const std::uint64_t programs = count("programs");
    for (const auto& [name, text] : {std::pair{"rate", "33"},
                                     {"wind", "4,0"},
                                     {"darken", "0.7"},
                                     {"fog", "0.01"},
                                     {"seed", "4"},
                                     {"env-order", "6"},
                                     {"fov", "40"},
                                     {"ground", "3"},
                                     {"speed", "1.5"}}) {
        virga_shot_set(shot.get(), name, text);
        ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK) << virga_error_sentence();
        EXPECT_EQ(count("programs"), programs) << name;
    }
    // An effect that comes for the first time needs its own; when it comes back, nothing.
    virga_shot_set(shot.get(), "blur", "1");
    ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK);
    const std::uint64_t withBlur = count("programs");
    EXPECT_GT(withBlur, programs);
    for (const char* blur : {"0", "2"}) {
        virga_shot_set(shot.get(), "blur", blur);
        ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK);
    }
    EXPECT_EQ(count("programs"), withBlur);
}

TEST_F(Sharing, LightOfOnePanoramaAndOfTheSameSamplesIsMadeOnce)
{
    Frame sky(64, 32);
    paint(sky);
    const float unseen = 1e-6f * float(std::random_device()() % 1'000'000);  // it is in no cache
    for (std::size_t i = 0; i < sky.size(); i += 4) sky.floats()[i] += unseen;
    const ShotPointer holder = smallShot();
    ASSERT_EQ(render(holder.get(), 0, plate, beauty), VIRGA_OK);
    const std::uint64_t before = count("environments");
    for (int i = 0; i < 3; ++i) {
        const ShotPointer shot = smallShot();
        ASSERT_EQ(virga_shot_set_environment(shot.get(), &sky.picture), VIRGA_OK);
        for (const char* rate : {"20", "50"}) {
            virga_shot_set(shot.get(), "rate", rate);
            ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK) << virga_error_sentence();
        }
        // What wind and darkening are leaves the light.
        virga_shot_set(shot.get(), "wind", "2,2");
        ASSERT_EQ(render(shot.get(), 1, plate, beauty), VIRGA_OK);
    }
    EXPECT_EQ(count("environments"), before + 1);
    const std::uint64_t withSky = count("environments");
    for (int i = 0; i < 3; ++i) {
        const ShotPointer shot = smallShot();
        ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
        ASSERT_EQ(render(shot.get(), 1, plate, i == 0 ? beauty : again), VIRGA_OK);
        if (i > 0) {
            EXPECT_EQ(again.planes(), beauty.planes());
        }
    }
    EXPECT_EQ(count("environments"), withSky + 1);
    // What goes into the light makes another.
    const ShotPointer shot = smallShot();
    ASSERT_EQ(virga_shot_add_plate_sample(shot.get(), 0, &plate.picture), VIRGA_OK);
    for (const auto& [name, text] : {std::pair{"env-gain", "2"}, {"sky", "3"}, {"background-boost", "0.5"}}) {
        virga_shot_set(shot.get(), name, text);
        ASSERT_EQ(render(shot.get(), 1, plate, again), VIRGA_OK);
        EXPECT_NE(again.planes(), beauty.planes()) << name;
    }
    EXPECT_EQ(count("environments"), withSky + 4);
}

TEST_F(Sharing, ADeviceThatIsNotThereIsReplacedByTheProcessor)
{
    const ShotPointer processor = smallShot(), absent = smallShot(64, 48, "999");
    ASSERT_EQ(render(processor.get(), 3, plate, beauty), VIRGA_OK);
    ASSERT_EQ(render(absent.get(), 3, plate, again), VIRGA_OK) << virga_error_sentence();
    EXPECT_EQ(again.planes(), beauty.planes());
    EXPECT_EQ(deviceOf(processor), "processor, without OpenGL");
    EXPECT_EQ(deviceOf(absent).find("processor, without OpenGL, in place of device '999': "), 0u) << deviceOf(absent);
    EXPECT_NE(deviceOf(absent).find("no such device"), std::string::npos);
    // So is a GPU, unless there is one.
    ASSERT_EQ(virga_shot_set_device(absent.get(), "gpu"), VIRGA_OK);
    ASSERT_EQ(render(absent.get(), 3, plate, again), VIRGA_OK) << virga_error_sentence();
    const std::string gpu = deviceOf(absent);
    EXPECT_TRUE(gpu.find("processor") == std::string::npos ||
                gpu.find("in place of device 'gpu': no usable OpenGL") != std::string::npos)
        << gpu;
    // Another one is tried once it is asked for.
    ASSERT_EQ(virga_shot_set_device(absent.get(), "cpu"), VIRGA_OK);
    ASSERT_EQ(render(absent.get(), 3, plate, again), VIRGA_OK);
    EXPECT_EQ(deviceOf(absent), "processor, without OpenGL");
}

double residentMegabytes()
{
    malloc_trim(0);
    std::ifstream statm("/proc/self/statm");
    double all = 0, resident = 0;
    statm >> all >> resident;
    return resident * double(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// Megabytes that the process has grown by from a third of the cycles on.
double growthOver(int cycles)
{
    Frame tiny(16, 12), result(16, 12);
    paint(tiny);
    double before = 0;
    for (int i = 0; i < cycles; ++i) {
        if (i == cycles / 3) before = residentMegabytes();
        const ShotPointer shot = smallShot(16, 12);
        virga_shot_set(shot.get(), "seed", std::to_string(i % 5).c_str());
        EXPECT_EQ(render(shot.get(), i, tiny, result), VIRGA_OK) << virga_error_sentence();
        virga_shot_set(shot.get(), "rat", "1");
    }
    return residentMegabytes() - before;
}

/// VIRGA_SHOT_CYCLES, or `usual`.
int cycles(int usual)
{
    const char* text = std::getenv("VIRGA_SHOT_CYCLES");
    return text != nullptr ? std::atoi(text) : usual;
}

TEST_F(Sharing, ShotsThatComeAndGoBesideAnotherLeaveNothing)
{
    const ShotPointer stays = smallShot();
    EXPECT_LT(growthOver(cycles(600)), 4.0);
}

// With the last shot the thread that renders ends, and all that was shared.
TEST_F(Sharing, ShotsThatComeAndGoAloneLeaveNothing) { EXPECT_LT(growthOver(cycles(600) / 10), 4.0); }

}  // namespace
}  // namespace virga::test
