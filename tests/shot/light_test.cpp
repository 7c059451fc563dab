#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "io/Plate.h"
#include "particles/CellHash.h"
#include "shot/Compositor.h"
#include "shot/LightKeyFrames.h"
#include "shot/PlateSamples.h"
#include "shot/ShotLight.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

bool sameBits(ConstImageViewF a, ConstImageViewF b)
{
    return a.width() == b.width() && a.height() == b.height() &&
           std::memcmp(a.data(), b.data(), std::size_t(a.width() * a.height() * a.channels()) * sizeof(float)) == 0;
}

/// Houses: blocks of their own brightness, `shift` pixels to the left, times `gain`, with grain.
PlateSamples::Frame houses(FrameNumber number, int shift, double gain)
{
    PlateSamples::Frame frame{number, ImageF(480, 270, 4, 1.0f)};
    for (int y = 0; y < 270; ++y) {
        for (int x = 0; x < 480; ++x) {
            const double block =
                particles::unitDouble(particles::mix(std::uint64_t((y / 40) * 1000 + (x + shift) / 40)));
            const double grain = particles::unitDouble(particles::mix(std::uint64_t(number * 1'000'000 + y * 480 + x)));
            for (int c = 0; c < 3; ++c) frame.pixels.at(x, y, c) = float(gain * block * (0.8 + 0.4 * grain));
        }
    }
    return frame;
}

TEST(PlateSamples, ALockedCameraIsSteadyThoughPeopleWalk)
{
    std::vector<PlateSamples::Frame> frames;
    for (int i = 0; i < 5; ++i) {
        frames.push_back(houses(i, 0, 1 + 0.02 * i));
        for (int y = 60; y < 270; ++y)  // a seventh of the picture, somewhere else each time
            for (int x = 90 * i; x < 90 * i + 90; ++x)
                for (int c = 0; c < 3; ++c) frames.back().pixels.at(x, y, c) = 0.02f;
    }
    std::string why;
    EXPECT_TRUE(isSteady(frames, why)) << why;
}

TEST(PlateSamples, CamerasAndLightThatChangeAreNotSteady)
{
    std::string why;
    EXPECT_FALSE(isSteady({houses(0, 0, 1), houses(1, 30, 1)}, why));
    EXPECT_EQ(why, "the picture moves");
    EXPECT_FALSE(isSteady({houses(0, 0, 1), houses(1, 0, 1), houses(2, 0, 1.3)}, why));
    EXPECT_EQ(why, "its light changes");
    // A cut to another place.
    EXPECT_FALSE(isSteady({houses(0, 0, 1), houses(1, 4000, 1)}, why));
    // One frame, black frames and broken ones are not a reason to fail.
    EXPECT_TRUE(isSteady({houses(0, 0, 1)}, why));
    EXPECT_TRUE(isSteady({{0, ImageF(64, 36, 4)}, {1, ImageF(64, 36, 4)}}, why));
    EXPECT_TRUE(isSteady({{0, ImageF(64, 36, 4, NAN)}, {1, ImageF(64, 36, 4, NAN)}}, why));
}

/// 101 frames of `frame`, which says what was read.
class ReaderOfHouses final : public io::PlateReader {
public:
    explicit ReaderOfHouses(std::function<PlateSamples::Frame(FrameNumber)> frame) : frame_(std::move(frame))
    {
        info_.width = 480;
        info_.height = 270;
        for (FrameNumber n = 0; n <= 100; ++n) info_.frames.push_back(n);
    }

    const io::PlateInfo& info() const override { return info_; }
    void schedule(const std::vector<FrameNumber>&, io::Pixels) override {}
    std::optional<io::PlateFrame> read(FrameNumber number) override
    {
        asked.push_back(number);
        io::PlateFrame frame;
        frame.number = number;
        frame.pixels = frame_(number).pixels;
        return frame;
    }

    std::vector<FrameNumber> asked;

private:
    std::function<PlateSamples::Frame(FrameNumber)> frame_;
    io::PlateInfo info_;
};

// A movie's frames may each take decoding all before it: whether the light is one for all is known from the first that
// is not steady. What is said of it is what all of them would say.
TEST(PlateSamples, AreReadAsFarAsTheyCount)
{
    using Numbers = std::vector<FrameNumber>;
    const auto pans = [](FrameNumber n) { return houses(n, n < 50 ? 0 : 60, 1); };
    Settings settings;
    ReaderOfHouses panning(pans);
    const PlateSamples samples = samplePlate(panning, settings, true, true);
    EXPECT_EQ(panning.asked, (Numbers{0, 25, 50}));
    std::string why;
    EXPECT_FALSE(isSteady(samples.forLight, why));
    EXPECT_EQ(why, "the picture moves");

    // A track says where the frames look: all count. So they do where nothing moves.
    ReaderOfHouses tracked(pans), still([](FrameNumber n) { return houses(n, 0, 1); });
    EXPECT_EQ(samplePlate(tracked, settings, true, false).forLight.size(), 5u);
    EXPECT_EQ(samplePlate(still, settings, true, true).forLight.size(), 5u);

    // A grade is judged by first, middle and last.
    settings.gradeFrom = "still.exr";
    ReaderOfHouses graded(pans);
    EXPECT_EQ(samplePlate(graded, settings, true, true).forGrade.size(), 3u);
    EXPECT_EQ(graded.asked, (Numbers{0, 25, 50, 100}));

    // Nothing is read where nothing asks for light or grade.
    ReaderOfHouses unasked(pans);
    samplePlate(unasked, Settings{}, false, true);
    EXPECT_TRUE(unasked.asked.empty());
}

/// A uniform panorama.
std::string gray(const TemporaryFolder& folder, const std::string& name, float radiance)
{
    io::writeExr(folder / name, ImageF(8, 4, 3, radiance), {"R", "G", "B"}, false);
    return folder / name;
}

float middle(ConstImageViewF map) { return map.at(map.width() / 2, map.height() / 2, 1); }

TEST(LightKeyFrames, BlendBetweenAndHoldOutside)
{
    const TemporaryFolder folder;
    gray(folder, "e.0010.exr", 1);
    gray(folder, "e.0020.exr", 3);
    gray(folder, "e.0025.exr", 2);
    Settings settings;
    settings.env = folder / "e.####.exr";
    ShotLight light(settings, {});
    const auto at = [&](FrameNumber frame) {
        light.update(frame, {});
        return middle(light.radiance());
    };
    for (const auto& [frame, radiance] : std::vector<std::pair<FrameNumber, float>>{
             {-7, 1}, {10, 1}, {11, 1.2}, {15, 2}, {20, 3}, {22, 2.6}, {25, 2}, {900, 2}, {15, 2}, {10, 1}}) {
        EXPECT_NEAR(at(frame), radiance, 1e-6) << frame;
    }
    EXPECT_FALSE(light.update(10, {}));
    EXPECT_TRUE(light.update(11, {}));
}

// A lamp in one of two makes its map larger; what is blended depends on the frame alone.
TEST(LightKeyFrames, MapsOfDifferentSizesBlendTheSameInAnyOrder)
{
    const TemporaryFolder folder;
    ImageF panorama(128, 64, 3, 0.5f);
    io::writeExr(folder / "e.0000.exr", panorama, {"R", "G", "B"}, false);
    for (int c = 0; c < 3; ++c) panorama.at(40, 20, c) = 4000;
    io::writeExr(folder / "e.0010.exr", panorama, {"R", "G", "B"}, false);
    Settings settings;
    settings.env = folder / "e.%04d.exr";
    ShotLight forward(settings, {}), jumping(settings, {});
    std::map<FrameNumber, ImageF> maps;
    for (const FrameNumber frame : {0, 3, 7, 10, 12}) {
        forward.update(frame, {});
        const ConstImageViewF map = forward.radiance();
        ImageF& copy = maps[frame] = ImageF(map.width(), map.height(), 3);
        std::copy_n(map.data(), copy.size(), copy.data());
    }
    EXPECT_NE(maps[0].width(), maps[10].width());
    for (const FrameNumber frame : {10, 7, 0, 12, 3, 0}) {
        jumping.update(frame, {});
        EXPECT_TRUE(sameBits(jumping.radiance(), maps[frame])) << frame;
    }
}

TEST(LightKeyFrames, NoFrameIsAnError)
{
    const TemporaryFolder folder;
    Settings settings;
    settings.env = folder / "none.####.exr";
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { ShotLight light(settings, {}); }),
                "no frame of that pattern exists");
}

// What is straight ahead in the panorama is seen `yaw` to the right and `pitch` up.
TEST(ShotLight, YawTurnsRightAndPitchTiltsUp)
{
    const TemporaryFolder folder;
    Settings settings;
    settings.env = gray(folder, "e.exr", 1);
    settings.envYaw_deg = 30;
    settings.envPitch_deg = 20;
    const ShotLight light(settings, {});
    const double yaw = glm::radians(30.0), pitch = glm::radians(20.0);
    const glm::dvec3 seen(std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch));
    EXPECT_LT(glm::length(light.environmentFromWorld() * seen - glm::dvec3(0, 0, -1)), 1e-12);
}

TEST(ShotLight, FewFramesLightTheWholeShot)
{
    const PlateSamples::Frame one = houses(0, 0, 1), other = houses(1, 0, 3);
    const environment::PlateView view{one.pixels, 1.0, glm::dmat3(1.0)}, later{other.pixels, 1.0, glm::dmat3(1.0)};
    ShotLight together(Settings(), {&view, 1}), each(Settings(), {});
    EXPECT_TRUE(together.update(0, view));
    const float before = middle(together.radiance());
    EXPECT_FALSE(together.update(1, later));
    EXPECT_EQ(middle(together.radiance()), before);

    EXPECT_TRUE(each.update(0, view));
    EXPECT_EQ(middle(each.radiance()), before);  // a frame by itself is a view by itself
    EXPECT_TRUE(each.update(1, later));
    EXPECT_GT(middle(each.radiance()), 2 * before);
}

// What is seen in a drop straight ahead is what is behind it: turning a bright half-world behind the camera darkens it.
TEST(ShotLight, APanoramaTurnedBySettingsIsTurnedInThePicture)
{
    const TemporaryFolder folder;
    ImageF half(128, 64, 3);
    for (int y = 0; y < 64; ++y)
        for (int x = 32; x < 96; ++x)
            for (int c = 0; c < 3; ++c) half.at(x, y, c) = 1;
    io::writeExr(folder / "half.exr", half, {"R", "G", "B"}, false);
    const auto rainAt = [&](double yaw, double pitch) {
        Settings settings;
        settings.env = folder / "half.exr";
        settings.envYaw_deg = yaw;
        settings.envPitch_deg = pitch;
        settings.rate_mm_h = 100;
        settings.fov_deg = 20;
        settings.darken = settings.desaturate = 0;
        Compositor compositor(settings, {160, 90, 24, 0},
                              {.wanted = {.layers = true}, .device = "cpu", .shaderFolder = {}}, {});
        io::PlateFrame plate;
        plate.pixels = ImageF(160, 90, 4, 1.0f);
        const io::RenderedFrame frame = compositor.render(std::move(plate));
        double light = 0, alpha = 0;
        const ImageF& rain = frame.layers.front().pixels;
        for (int y = 0; y < 90; ++y) {
            for (int x = 0; x < 160; ++x) {
                light += rain.at(x, y, 1);
                alpha += rain.at(x, y, 3);
            }
        }
        return light / alpha;
    };
    EXPECT_GT(rainAt(0, 0), 0.85);
    EXPECT_LT(rainAt(180, 0), 0.15);
    EXPECT_NEAR(rainAt(90, 0), 0.5, 0.05);
    EXPECT_NEAR(rainAt(0, 90), 0.5, 0.05);  // the bright half is overhead
    EXPECT_LT(rainAt(0, 180), 0.15);
}

// The order is of the drops' light. Fog shows what is behind it at any, unless the boost needs what the order leaves
// out.
TEST(ShotLight, TheOrderDoesNotChangeWhatIsBehindTheFog)
{
    const TemporaryFolder folder;
    ImageF panorama(64, 32, 3, 0.1f);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 64; ++x) panorama.at(x, y, 2) = x % 8 < 3 ? 0.7f : 0.3f;
    io::writeExr(folder / "env.exr", panorama, {"R", "G", "B"}, false);
    Settings settings;
    settings.env = folder / "env.exr";
    const ShotLight usual(settings, {});
    const auto difference = [&](double order, double boost, bool isPaper) {
        Settings other = settings;
        other.envOrder = order;
        other.backgroundBoost = boost;
        other.paper = isPaper;
        const ShotLight light(other, {});
        double most = 0;
        for (int i = 0; i < 100; ++i) {
            const glm::dvec3 direction = glm::normalize(glm::dvec3(std::sin(i), std::cos(3 * i), std::cos(i)));
            most = std::max(most, glm::length(environment::sampleMap(light.lowPassBackground(), direction) -
                                              environment::sampleMap(usual.lowPassBackground(), direction)));
        }
        return most;
    };
    for (const double order : {0.0, 3.0, 40.0, 128.0}) EXPECT_LT(difference(order, 0, false), 1e-5) << order;
    EXPECT_GT(difference(3, 0.5, false), 0.05);
    EXPECT_GT(difference(3, 0, true), 0.05);
}

}  // namespace
}  // namespace virga::shot
