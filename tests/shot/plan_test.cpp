#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "shot/FramePlan.h"

namespace virga::shot {
namespace {

/// The features that are on, by name.
std::set<std::string> on(const FramePlan& plan)
{
    const passes::Features& f = plan.features;
    const std::map<std::string, bool> all = {{"rain", f.rain},
                                             {"fog", f.fog},
                                             {"depth", f.depth},
                                             {"splashes", f.splashes},
                                             {"blur", f.blur},
                                             {"darken", f.darken},
                                             {"colorTransfer", f.colorTransfer},
                                             {"boost", f.boost},
                                             {"layers", f.layers},
                                             {"cameraMotion", f.cameraMotion},
                                             {"nearest", f.nearest},
                                             {"lights", f.lights}};
    std::set<std::string> names;
    for (const auto& [name, isOn] : all)
        if (isOn) names.insert(name);
    return names;
}

const PlannedPass& passOf(const FramePlan& plan, const std::string& name)
{
    const auto found =
        std::find_if(plan.passes.begin(), plan.passes.end(), [&](const auto& p) { return p.name == name; });
    if (found == plan.passes.end()) throw std::runtime_error("no pass '" + name + "' in the plan");
    return *found;
}

Settings everything()
{
    Settings s;
    s.rate_mm_h = 25;
    s.opacity = 1;
    s.splashes = 1;
    s.ground = "1.6";
    s.fog_1_m = 0.01;
    s.blur_px = 2;
    s.darken = 0.2;
    s.desaturate = 0.2;
    s.gradeFrom = "still.png";
    s.backgroundBoost = 0.5;
    s.lights = "lamps.toml";
    return s;
}

struct Without {
    const char* name;
    void (*change)(Settings&, Wanted&, bool& cameraMoves);
    std::set<std::string> gone;  // features
    const char* pass;            // of the plan, which then does not run
    const char* why;
};

const Without cases[] = {
    {"rain",
     [](Settings& s, Wanted&, bool&) { s.rate_mm_h = 0; },
     {"rain", "splashes", "boost", "cameraMotion", "nearest"},
     "strokes",
     "--rate is 0"},
    {"opacity",
     [](Settings& s, Wanted&, bool&) { s.opacity = 0; },
     {"rain", "cameraMotion", "nearest"},
     "strokes",
     "--opacity is 0"},
    {"fog", [](Settings& s, Wanted&, bool&) { s.fog_1_m = 0; }, {"fog"}, "fog", "--fog is 0"},
    {"splashes", [](Settings& s, Wanted&, bool&) { s.splashes = 0; }, {"splashes"}, "splashes", "--splashes is 0"},
    {"geometry",
     [](Settings& s, Wanted&, bool&) { s.ground.clear(); },
     {"depth", "splashes"},
     "depth",
     "no --depth and no --ground"},
    {"blur", [](Settings& s, Wanted&, bool&) { s.blur_px = 0; }, {"blur"}, "blur", "--blur is 0"},
    {"darkening",
     [](Settings& s, Wanted&, bool&) { s.darken = s.desaturate = 0; },
     {"darken"},
     "darken",
     "--darken and --desaturate are 0"},
    {"still",
     [](Settings& s, Wanted&, bool&) { s.gradeFrom.clear(); },
     {"colorTransfer"},
     "color-transfer",
     "no --grade-from"},
    {"gradeAmount",
     [](Settings& s, Wanted&, bool&) { s.gradeAmount = 0; },
     {"colorTransfer"},
     "color-transfer",
     "--grade-amount is 0"},
    {"boost",
     [](Settings& s, Wanted&, bool&) { s.backgroundBoost = 0; },
     {"boost"},
     "background-boost",
     "--background-boost is 0"},
    {"lamps", [](Settings& s, Wanted&, bool&) { s.lights.clear(); }, {"lights"}, "lights", "no --lights"},
    {"motion",
     [](Settings&, Wanted&, bool& moves) { moves = false; },
     {"cameraMotion"},
     "camera-motion",
     "the camera stands still"},
    {"layers",
     [](Settings&, Wanted& wanted, bool&) { wanted.layers = false; },
     {"layers", "nearest"},
     "layers",
     "no --layers"},
};

TEST(Plan, WithoutAnEffectLosesThatAndNothingElse)
{
    for (const Without& without : cases) {
        SCOPED_TRACE(without.name);
        const FramePlan whole = planFrame(everything(), {.layers = true}, true);
        Settings settings = everything();
        Wanted wanted{.layers = true};
        bool cameraMoves = true;
        without.change(settings, wanted, cameraMoves);
        const FramePlan plan = planFrame(settings, wanted, cameraMoves);
        std::set<std::string> expected = on(whole);
        for (const std::string& name : without.gone) EXPECT_EQ(expected.erase(name), 1u) << name;
        EXPECT_EQ(on(plan), expected);
        EXPECT_TRUE(passOf(whole, without.pass).runs);
        EXPECT_FALSE(passOf(plan, without.pass).runs);
        EXPECT_EQ(passOf(plan, without.pass).why, without.why);
        EXPECT_FALSE(plan.isPassThrough());
        for (const PlannedPass& pass : plan.passes)
            if (!pass.runs) {
                EXPECT_FALSE(pass.why.empty()) << pass.name;
            }
    }
}

TEST(Plan, EverythingRunsEverything)
{
    const FramePlan plan = planFrame(everything(), {.layers = true}, true);
    EXPECT_EQ(on(plan).size(), 12u);
}

TEST(Plan, EveryEffectOffIsAPassThrough)
{
    Settings s = everything();
    s.rate_mm_h = s.darken = s.desaturate = s.blur_px = s.splashes = 0;
    s.fog_1_m = 0;
    s.gradeFrom.clear();
    for (const bool layers : {false, true})
        for (const bool moves : {false, true}) {
            const FramePlan plan = planFrame(s, {.layers = layers}, moves);
            EXPECT_TRUE(plan.isPassThrough());
            EXPECT_TRUE(on(plan).empty());
            for (const PlannedPass& pass : plan.passes) EXPECT_FALSE(pass.runs) << pass.name;
        }
}

TEST(Plan, AutomaticFogComesAndGoesWithTheRain)
{
    Settings s;
    EXPECT_TRUE(planFrame(s, {}, false).features.fog);
    s.rate_mm_h = 0;
    EXPECT_FALSE(planFrame(s, {}, false).features.fog);
    s.strokes = 1000;  // rain after all
    EXPECT_TRUE(planFrame(s, {}, false).features.fog);
    EXPECT_TRUE(planFrame(s, {}, false).features.rain);
}

TEST(Plan, NobodyReadsDepthForAGradeAlone)
{
    Settings s;
    s.rate_mm_h = 0;
    s.ground = std::string("2");
    const FramePlan plan = planFrame(s, {}, true);
    EXPECT_EQ(on(plan), std::set<std::string>{"darken"});
    EXPECT_FALSE(plan.cameraMoves);
    EXPECT_EQ(passOf(plan, "depth").why, "nothing looks at it");
    EXPECT_EQ(passOf(plan, "environment").runs, false);
}

}  // namespace
}  // namespace virga::shot
