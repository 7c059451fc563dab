// What is skipped is not missed: pictures with and without (docs/skipping.md).
#include "shot/Skips.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/Error.h"
#include "io/Plate.h"
#include "shot/Compositor.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

using test::TemporaryFolder;

constexpr int width = 96, height = 54;

/// The same picture for every number if `content` is not 0.
io::PlateFrame plateOf(FrameNumber number, std::uint64_t content = 0)
{
    io::PlateFrame plate;
    plate.number = number;
    plate.content = content;
    plate.pixels = ImageF(width, height, 4, 1.0f);
    const auto turn = int(content == 0 ? number : 0);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c)
                plate.pixels.at(x, y, c) =
                    y < height / 2 ? 0.7f + 0.1f * float(c) : ((x + turn) / 8 % 2 ? 0.05f : 0.2f);
    return plate;
}

/// A room: walls at 3 m, a door to the sky.
std::string writeRoom(const TemporaryFolder& folder)
{
    ImageF depth(width, height, 1, 3.0f);
    for (int y = 10; y < 45; ++y)
        for (int x = 40; x < 55; ++x) depth.at(x, y) = std::numeric_limits<float>::infinity();
    io::writeExr(folder / "room.exr", depth, {"Z"}, false);
    return folder / "room.exr";
}

struct Case {
    const char* name;
    std::function<void(Settings&, const TemporaryFolder&)> scene;
    bool Skips::*skip;
    double tolerance;                                                 // of scene-linear light
    std::function<std::size_t(const CompositorStatistics&)> skipped;  // what shows that something was; may be null
    std::uint64_t content = 0;
};

const Case cases[] = {
    {"cells behind the depth, a camera that moves and turns",
     [](Settings& s, const TemporaryFolder& folder) {
         s.depth = writeRoom(folder);
         s.camera = folder.write("move.chan", "0 0 0 0 0 0 0\n4 0.4 0 -0.5 2 20 0\n");
         s.threshold = 0.002;
         s.shutter_deg = 180;
     },
     &Skips::behindDepth, 0, [](const CompositorStatistics& s) { return s.hiddenCells; }},
    {"cells behind the depth, out of focus",
     [](Settings& s, const TemporaryFolder& folder) {
         s.depth = writeRoom(folder);
         s.focus_m = 1;
         s.fstop = 0.7;
         s.threshold = 0.002;
     },
     &Skips::behindDepth, 0, [](const CompositorStatistics& s) { return s.hiddenCells; }},
    {"cells out of view",
     [](Settings& s, const TemporaryFolder& folder) {
         s.far_m = 5;
         s.camera = folder.write("turn.chan", "0 0 0 0 0 0 0\n4 0 0 0 0 40 0\n");
     },
     &Skips::outOfView, 0, nullptr},
    {"cells under the threshold", [](Settings& s, const TemporaryFolder&) { s.far_m = 15; }, &Skips::faint, 0, nullptr},
    {"passes that change nothing",
     [](Settings& s, const TemporaryFolder& folder) {
         s.depth = writeRoom(folder);
         s.darken = s.desaturate = s.splashes = 0;
         s.fog_1_m = 0;
     },
     &Skips::passes, 5e-6, nullptr},
    {"passes that change nothing, fog alone",
     [](Settings& s, const TemporaryFolder&) {
         s.opacity = 0;
         s.fog_1_m = 0.01;
     },
     &Skips::passes, 5e-6, nullptr},
    {"lamps whose light does not arrive",
     [](Settings& s, const TemporaryFolder& folder) {
         s.lights = folder.write("lamps.toml",
                                 "[[light]]\nposition = [1, 2, -5]\nintensity = [3, 2, 1]\n"
                                 "[[light]]\nposition = [0, 0, 3e3]\nintensity = [5, 5, 5]\n"
                                 "[[light]]\nposition = [0, 0, -4]\nintensity = [0, 0, 0]\n");
     },
     &Skips::farLamps, 2e-5, [](const CompositorStatistics& s) { return s.lampsLeftOut; }},
    {"a plate that does not change, and its light",
     [](Settings& s, const TemporaryFolder&) { s.backgroundBoost = 0.5; }, &Skips::unchanged, 0,
     [](const CompositorStatistics& s) { return s.samePlates; }, 7},
};

/// The greatest difference of beauty and layers; layers of data count when they differ at all.
double difference(const io::RenderedFrame& a, const io::RenderedFrame& b)
{
    EXPECT_EQ(a.layers.size(), b.layers.size());
    double most = 0;
    const auto compare = [&](const ImageF& one, const ImageF& other) {
        ASSERT_EQ(one.size(), other.size());
        for (std::size_t i = 0; i < one.size(); ++i)
            if (one.data()[i] != other.data()[i])
                most = std::max(most, std::abs(double(one.data()[i]) - double(other.data()[i])));
    };
    compare(a.beauty, b.beauty);
    for (std::size_t i = 0; i < std::min(a.layers.size(), b.layers.size()); ++i)
        compare(a.layers[i].pixels, b.layers[i].pixels);
    return most;
}

struct Rendered {
    std::vector<io::RenderedFrame> frames;
    CompositorStatistics statistics;
};

/// Nothing if the device is not there.
std::optional<Rendered> renderedBy(const Settings& settings, const CompositorOptions& options, std::uint64_t content)
{
    std::optional<Compositor> compositor;
    try {
        compositor.emplace(settings, Shot{width, height, 24, 0}, options, PlateSamples{});
    } catch (const Error& error) {
        if (error.code() != ErrorCode::Graphics) throw;
        return std::nullopt;
    }
    Rendered rendered;
    for (const FrameNumber frame : {0, 1, 3}) rendered.frames.push_back(compositor->render(plateOf(frame, content)));
    rendered.statistics = compositor->statistics();
    return rendered;
}

class Skipping : public testing::TestWithParam<const char*> {};

TEST_P(Skipping, ChangesNoPicture)
{
    for (const Case& test : cases) {
        SCOPED_TRACE(test.name);
        const TemporaryFolder folder;
        Settings settings;
        test.scene(settings, folder);
        // An idle pass changes what the others round to, and only layers that are asked for are compared.
        const bool hasLayers = test.skip != &Skips::passes;
        CompositorOptions options = {.wanted = {.layers = hasLayers}, .device = GetParam(), .shaderFolder = {}};
        const std::optional<Rendered> found = renderedBy(settings, options, test.content);
        options.wanted.skips.*test.skip = false;
        const std::optional<Rendered> expected = renderedBy(settings, options, test.content);
        if (!found || !expected) GTEST_SKIP() << "no OpenGL device";
        for (std::size_t i = 0; i < expected->frames.size(); ++i) {
            EXPECT_LE(difference(found->frames[i], expected->frames[i]), test.tolerance) << "frame " << i;
            io::RenderedFrame plate = found->frames[i];
            plate.beauty = plateOf(plate.number, test.content).pixels;
            EXPECT_GT(difference(found->frames[i], plate), 1e-3) << "nothing is drawn";
        }
        if (!test.skipped) continue;
        EXPECT_GT(test.skipped(found->statistics), 0u);
        EXPECT_EQ(test.skipped(expected->statistics), 0u);
    }
}

// Without OpenGL, and the shaders on whatever device is the first.
INSTANTIATE_TEST_SUITE_P(Devices, Skipping, testing::Values("cpu", "0"),
                         [](const auto& info) { return std::string(info.param) == "cpu" ? "Processor" : "Shaders"; });

TEST(Skips, IdlePassesRunWhenTheyAreNotSkipped)
{
    Settings s;
    s.fog_1_m = 0;
    const passes::Features lean = planFrame(s, {}, false).features;
    const passes::Features all = planFrame(s, {.skips = {.passes = false}}, false).features;
    EXPECT_FALSE(lean.fog || lean.blur || lean.lights || lean.boost || lean.layers || lean.nearest);
    EXPECT_TRUE(all.fog && all.blur && all.lights && all.boost && all.layers && all.nearest && all.cameraMotion);
    s.rate_mm_h = s.darken = s.desaturate = 0;
    EXPECT_TRUE(planFrame(s, {.skips = {.passes = false}}, false).isPassThrough());
}

TEST(Skips, LampsThatReachNoDropHaveNoPass)
{
    const TemporaryFolder folder;
    const std::string far = folder.write("far.toml", "[[light]]\nposition = [0, 0, 5e4]\nintensity = [1, 1, 1]\n");
    const CompositorOptions options = {.wanted = {}, .device = "cpu", .shaderFolder = {}};
    Settings s;
    s.lights = far;
    const Compositor still(s, {width, height, 24, 0}, options, {});
    EXPECT_FALSE(still.plan().features.lights);
    for (const PlannedPass& pass : still.plan().passes)
        if (pass.name == "lights") {
            EXPECT_EQ(pass.why, fmt::format("no light of '{}' reaches a drop", far));
        }
    s.camera = folder.write("fly.chan", "0 0 0 0 0 0 0\n9 0 0 50000 0 0 0\n");
    EXPECT_TRUE(Compositor(s, {width, height, 24, 0}, options, {}).plan().features.lights);
}

}  // namespace
}  // namespace virga::shot
