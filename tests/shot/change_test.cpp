// Moving one parameter makes anew what depends on it, nothing else, and the frame is that of a shot made so at first.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <set>
#include <string>

#include "core/Error.h"
#include "io/Plate.h"
#include "shot/Compositor.h"
#include "shot/Dependencies.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

using test::TemporaryFolder;

constexpr int width = 96, height = 54;
const CompositorOptions forChanges = {.wanted = {.layers = true}, .device = "cpu", .changes = true};

ImageF plate()
{
    ImageF image(width, height, 4, 1.0f);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = (y < 20 ? 0.8f : 0.1f) + 0.002f * float(x + 10 * c);
    return image;
}

PlateSamples samples()
{
    PlateSamples all;
    all.forLight.push_back({0, plate()});
    all.forGrade.push_back(plate());
    return all;
}

io::RenderedFrame frameOf(Compositor& compositor, FrameNumber number = 5)
{
    io::PlateFrame frame;
    frame.number = number;
    frame.content = 1;
    frame.pixels = plate();
    return compositor.render(std::move(frame), View{}, {});
}

/// Files that parameters may name, and settings in which they all count for something.
struct World {
    TemporaryFolder folder;
    Settings settings;

    World()
    {
        io::writeExr(folder / "env.exr", ImageF(32, 16, 3, 0.7f), {"R", "G", "B"}, false);
        ImageF other(32, 16, 3, 0.2f);
        for (int x = 0; x < 8; ++x) other.at(x, 3, 2) = 20;
        io::writeExr(folder / "other.exr", other, {"R", "G", "B"}, false);
        ImageF depth(width, height, 1);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) depth.at(x, y) = x < 40 ? 5.0f : 3.0f + float(y);
        io::writeExr(folder / "depth.exr", depth, {"Z"}, false);
        folder.write("lamps.toml", "[[light]]\nposition = [1, 2, -6]\nintensity = [30, 20, 9]\n");
        folder.write("track.chan", "0 0 1.6 0 -4 0 0 40\n20 0.4 1.6 -2 -4 9 0 44\n");
        settings.rate_mm_h = 50;
        settings.ground = "1.6";
        settings.env = folder / "env.exr";
        settings.fps = 24;
    }

    /// Texts to set the parameter to, one after the other.
    std::vector<std::string> otherValues(const Parameter& p) const
    {
        static const std::map<std::string, std::vector<std::string>> special = {
            {"rate", {"0", "20"}},
            {"strokes", {"3000", "auto"}},
            {"opacity", {"0", "1"}},
            {"seed", {"7"}},
            {"near", {"1.5"}},
            {"far", {"40"}},
            {"shutter", {"90", "auto"}},
            {"exposure", {"0.01"}},
            {"fov", {"40", "auto"}},
            {"fps", {"30"}},
            {"env-order", {"4"}},
            {"light-radiance", {"30"}},
            {"fog", {"0", "0.02", "auto"}},
            {"fog-color", {"0.3,0.3,0.4", "auto"}},
            {"blur", {"2", "0"}},
            {"wind", {"4,-3"}},
            {"grade-amount", {"0.5"}},
            {"ground", {"2.5,8"}},
            {"splashes", {"0", "3"}},
            {"darken", {"0", "0.4"}},
        };
        if (const auto found = special.find(p.name); found != special.end()) return found->second;
        const std::string name = p.name;
        if (name == "env") return {"", folder / "other.exr"};
        if (name == "depth") return {folder / "depth.exr", ""};
        if (name == "lights") return {folder / "lamps.toml", ""};
        if (name == "camera") return {folder / "track.chan", ""};
        if (name == "grade-from") return {folder / "other.exr", ""};
        if (p.isSwitch()) return {"true", "false"};
        if (std::holds_alternative<double Settings::*>(p.member)) {
            const double now = settings.*std::get<double Settings::*>(p.member);
            return {fmt::format("{}", std::min(p.most, now > 0 ? 2 * now : 0.5))};
        }
        return {};
    }
};

bool sameBits(const ImageF& a, const ImageF& b)
{
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST(Dependencies, EveryParameterHasItsRow)
{
    for (const Parameter& p : parameters()) EXPECT_NO_THROW(partsOf(p));
    Settings a, b;
    EXPECT_EQ(partsThatDiffer(a, b), NoPart);
    b.wind_m_s = {1, 2};
    EXPECT_EQ(partsThatDiffer(a, b) & (LightPart | DepthPart | CameraPart), NoPart);
    b = {};
    b.darken = 0.7;
    EXPECT_EQ(partsThatDiffer(a, b), NoPart);
}

/// The law: whatever is changed, the frame is that of a compositor that had those settings from the start, bit for bit.
TEST(Change, FramesAreThoseOfAFreshShot)
{
    const World world;
    const PlateSamples plates = samples();
    const Shot shot{width, height, 24, 0};
    Compositor live(world.settings, shot, forChanges, plates);
    frameOf(live);
    std::set<std::string> changed;
    for (const Parameter& p : parameters()) {
        Settings settings = world.settings;
        for (const std::string& text : world.otherValues(p)) {
            setFromText(settings, p, text);
            SCOPED_TRACE(fmt::format("--{} '{}'", p.name, text));
            live.change(settings);
            Compositor fresh(settings, shot, forChanges, plates);
            const io::RenderedFrame a = frameOf(live), b = frameOf(fresh);
            EXPECT_TRUE(sameBits(a.beauty, b.beauty));
            EXPECT_EQ(a.layers.size(), b.layers.size());
            for (std::size_t i = 0; i < std::min(a.layers.size(), b.layers.size()); ++i)
                EXPECT_TRUE(sameBits(a.layers[i].pixels, b.layers[i].pixels)) << a.layers[i].name;
            if (!sameBits(a.beauty, frameOf(live, 6).beauty)) changed.insert(p.name);
        }
        live.change(world.settings);
    }
    EXPECT_GT(changed.size(), 30u) << "settings that leave rain on the picture";
    Compositor fresh(world.settings, shot, forChanges, plates);
    EXPECT_TRUE(sameBits(frameOf(live).beauty, frameOf(fresh).beauty));
}

TEST(Change, MakesOnlyWhatDepends)
{
    const World world;
    Compositor live(world.settings, {width, height, 24, 0}, forChanges, samples());
    frameOf(live);
    const auto madeBy = [&](const char* name, const char* text) {
        auto before = live.statistics().made;
        Settings settings = world.settings;
        setFromText(settings, findParameter(name), text);
        live.change(settings);
        frameOf(live);
        std::set<std::string> made;
        for (const auto& [part, count] : live.statistics().made)
            if (count != before[part]) made.insert(part);
        live.change(world.settings);
        return made;
    };
    using Parts = std::set<std::string>;
    EXPECT_EQ(madeBy("wind", "3,4"), Parts{"rain"});
    EXPECT_EQ(madeBy("rate", "10"), Parts{"rain"});
    EXPECT_EQ(madeBy("darken", "0.5"), Parts{});
    EXPECT_EQ(madeBy("splashes", "3"), Parts{});
    EXPECT_EQ(madeBy("fog-distance", "30"), Parts{});
    EXPECT_EQ(madeBy("env-yaw", "30"), Parts{"light"});
    EXPECT_EQ(madeBy("fog", "0"), Parts{"renderer"}) << "it has no fog then";
    EXPECT_EQ(madeBy("fov", "40"), (Parts{"camera", "depth", "light", "rain"}));
}

TEST(Change, LeavesEverythingIfItThrows)
{
    const World world;
    Compositor live(world.settings, {width, height, 24, 0}, forChanges, samples());
    const ImageF before = frameOf(live).beauty;
    for (const auto& [name, text] : {std::pair{"env", "no such.exr"},
                                     {"mattes", "no such.exr"},
                                     {"depth", "none.exr"},
                                     {"camera", "none.chan"},
                                     {"far", "0.05"},
                                     {"grade-from", "none.png"}}) {
        Settings settings = world.settings;
        setFromText(settings, findParameter(name), text);
        EXPECT_THROW(live.change(settings), Error) << name;
        EXPECT_TRUE(sameBits(frameOf(live).beauty, before)) << name;
    }
}

}  // namespace
}  // namespace virga::shot
