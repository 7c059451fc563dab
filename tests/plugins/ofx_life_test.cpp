// The OpenFX plug-in in a host that holds it to the standard: its life, its panel, its answers, what goes wrong.
#include "OfxFixture.h"

namespace virga::test {
namespace {

TEST_F(Ofx, LivesTwice)
{
    for (int life = 0; life < 2; ++life) {
        start();
        ASSERT_EQ(loaded_, ofx::statOk);
        EXPECT_STREQ(plugin_->pluginApi, ofx::imageEffectApi);
        EXPECT_EQ(plugin_->apiVersion, 1);
        for (const char* context : {filter, general}) {
            HostEffect& rain = effect(context);
            EXPECT_EQ(rain.hasClip("Depth"), context == general);
            EXPECT_EQ(rain.hasClip("Environment"), context == general);
            EXPECT_EQ(rain.description().text(ofx::prop::threadSafety), ofx::value::fullySafe);
            ASSERT_EQ(rain.create(), ofx::statOk);
            PropertySet preferences("out preferences"), definition("out definition"), in("in regions");
            in.put(ofx::prop::time, {0.0});
            EXPECT_EQ(rain.act(ofx::action::getClipPreferences, nullptr, &preferences), ofx::statOk);
            EXPECT_EQ(preferences.number(ofx::prop::frameVarying), 1);
            EXPECT_EQ(rain.act(ofx::action::getRegionOfDefinition, &in, &definition), ofx::statOk);
            EXPECT_EQ(definition.number(ofx::prop::regionOfDefinition, 2), width);
            PropertySet sequence("in render");
            sequence.put(ofx::prop::frameRange, {0.0, 1.0});
            EXPECT_EQ(rain.act(ofx::action::beginSequenceRender, &sequence), ofx::statOk);
            EXPECT_EQ(rain.render(life, whole).status, ofx::statOk);
            rain.act(ofx::action::endSequenceRender, &sequence);
            EXPECT_EQ(rain.act(ofx::action::purgeCaches), ofx::statOk);
            EXPECT_EQ(rain.render(1, whole).status, ofx::statOk);
            EXPECT_EQ(rain.destroy(), ofx::statOk);
        }
        EXPECT_TRUE(host_->messages.empty()) << host_->messages.front();
    }
}

TEST_F(Ofx, UnknownActionsAreLeftToTheHost)
{
    start();
    HostEffect& rain = effect();
    ASSERT_EQ(rain.create(), ofx::statOk);
    EXPECT_EQ(rain.act("OfxActionOfTheFuture"), ofx::statReplyDefault);
    EXPECT_EQ(rain.act(ofx::action::getTimeDomain), ofx::statReplyDefault);
}

TEST_F(Ofx, PanelIsTheTable)
{
    start();
    HostEffect& rain = effect();
    std::size_t rows = 0;
    for (std::size_t i = 0; i < virga_parameter_count(); ++i) {
        const virga_parameter& row = *virga_parameter_at(i);
        std::string name = row.name;
        std::replace(name.begin(), name.end(), '-', '_');
        if (std::string(row.group) == "file") {
            EXPECT_FALSE(rain.hasParameter(name)) << name;
            continue;
        }
        ++rows;
        ASSERT_TRUE(rain.hasParameter(name)) << name;
        const PropertySet& control = rain.parameter(name);
        EXPECT_EQ(control.text(ofx::prop::parent), std::string("group_") + row.group);
        EXPECT_TRUE(control.text(ofx::prop::hint).starts_with(row.help)) << name;
        const bool mayBeAuto = row.type == VIRGA_NUMBER_OR_AUTO || row.type == VIRGA_COLOR_OR_AUTO;
        EXPECT_EQ(rain.hasParameter(name + "_auto"), mayBeAuto) << name;
        if (control.count(ofx::prop::displayLeast) > 0) {
            const double start = control.number(ofx::prop::defaultValue);
            EXPECT_GE(control.number(ofx::prop::displayLeast), control.number(ofx::prop::least)) << name;
            EXPECT_LE(control.number(ofx::prop::displayMost), control.number(ofx::prop::most)) << name;
            EXPECT_LT(control.number(ofx::prop::displayLeast), control.number(ofx::prop::displayMost)) << name;
            EXPECT_GE(start, control.number(ofx::prop::displayLeast)) << name;
            EXPECT_LE(start, control.number(ofx::prop::displayMost)) << name;
            // A slider of a thousand steps has to reach what people turn to.
            EXPECT_LE(control.number(ofx::prop::displayMost) - control.number(ofx::prop::displayLeast), 200000) << name;
        }
    }
    EXPECT_GT(rows, 50U);
    EXPECT_EQ(rain.parameter("rate").text(ofx::prop::label), "Rate");
    EXPECT_NE(rain.parameter("rate").text(ofx::prop::hint).find("[mm/h]"), std::string::npos);
    EXPECT_EQ(rain.parameter("depth_kind").count(ofx::prop::choiceOption), 4U);
    EXPECT_EQ(rain.parameter("env").text(ofx::prop::stringMode), ofx::value::stringFilePath);
}

TEST_F(Ofx, IdentityWithoutEffects)
{
    start();
    HostEffect& rain = effect();
    ASSERT_EQ(rain.create(), ofx::statOk);
    std::string clip;
    EXPECT_FALSE(rain.isIdentity(0));
    for (const char* name : {"rate", "darken", "desaturate", "splashes"}) rain.set(name, 0.0);
    rain.set("fog_auto", 0.0);
    rain.set("fog", 0.0);
    EXPECT_TRUE(rain.isIdentity(0, &clip));
    EXPECT_EQ(clip, "Source");
    EXPECT_EQ(largestDifference(rain.render(1, whole).pixels, plate(1)), 0);
    rain.set("output", 1);
    EXPECT_FALSE(rain.isIdentity(0));  // the rain alone is black, not the source
    rain.set("output", 0.0);
    rain.animate("rate", [](double t) { return t < 2 ? 0.0 : 50.0; });
    EXPECT_TRUE(rain.isIdentity(1));
    EXPECT_FALSE(rain.isIdentity(2));
}

TEST_F(Ofx, StopsWhenTheHostWants)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    ASSERT_EQ(rain.create(), ofx::statOk);
    const ImageF expected = rain.render(1, whole).pixels;
    rain.abort = [] { return true; };
    EXPECT_EQ(rain.render(2, whole).status, ofx::statOk);
    EXPECT_TRUE(host_->messages.empty());
    rain.abort = [] { return false; };
    EXPECT_EQ(largestDifference(rain.render(1, whole).pixels, expected), 0);
}

TEST_F(Ofx, SaysWhatIsWrong)
{
    start();
    HostEffect& rain = effect();
    rain.set("env", "/none/panorama.exr");
    ASSERT_EQ(rain.create(), ofx::statOk);
    EXPECT_FALSE(rain.isIdentity(1));
    EXPECT_EQ(rain.render(1, whole).status, ofx::statFailed);
    ASSERT_FALSE(host_->messages.empty());
    EXPECT_NE(host_->messages.back().find("/none/panorama.exr"), std::string::npos) << host_->messages.back();
    rain.set("env", "");
    EXPECT_EQ(rain.render(1, whole).status, ofx::statOk);
    rain.set("rate", -5);
    EXPECT_FALSE(rain.isIdentity(1));
    EXPECT_EQ(rain.render(1, whole).status, ofx::statFailed);
    EXPECT_NE(host_->messages.back().find("0 to 2000"), std::string::npos) << host_->messages.back();
    rain.set("rate", 5);
    rain.clip("Source").hasGone = true;
    rain.render(1, whole);
    rain.clip("Source").hasGone = false;
    EXPECT_EQ(rain.render(1, whole).status, ofx::statOk);
}

TEST_F(Ofx, PoorHosts)
{
    start({.messagesStay = false, .messages = false, .temporalAccess = false, .multipleDepths = false, .isPoor = true});
    ASSERT_EQ(loaded_, ofx::statOk);
    for (const char* context : {filter, general}) {
        HostEffect& rain = effect(context);
        ASSERT_EQ(rain.create(), ofx::statOk);
        EXPECT_EQ(rain.render(1, whole).status, ofx::statOk);
        rain.set("env", "/none/panorama.exr");
        EXPECT_EQ(rain.render(1, whole).status, ofx::statFailed);  // and no suite to say it by
    }
    for (const char* suite : {ofx::suite::property, ofx::suite::imageEffect, ofx::suite::parameter}) {
        start({.missingSuite = suite});
        EXPECT_EQ(loaded_, ofx::statErrMissingHostFeature) << suite;
    }
    start({.missingSuite = ofx::suite::message});
    EXPECT_EQ(loaded_, ofx::statOk);
}

TEST_F(Ofx, ManyThreads)
{
    start();
    HostEffect &one = effect(), &two = effect();
    for (HostEffect* rain : {&one, &two}) {
        heavyRain(*rain);
        rain->animate("rate", [](double t) { return 40 + 20 * t; });
    }
    two.set("seed", 8);
    ASSERT_EQ(one.create(), ofx::statOk);
    ASSERT_EQ(two.create(), ofx::statOk);
    std::vector<ImageF> expected, expectedOfTwo;
    for (int n = 0; n < frames; ++n) {
        expected.push_back(one.render(n, whole).pixels);
        expectedOfTwo.push_back(two.render(n, whole).pixels);
    }
    std::vector<std::thread> threads;
    std::atomic<int> wrong = 0;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            HostEffect& rain = t % 2 == 0 ? one : two;
            for (int i = 0; i < 2 * frames; ++i) {
                const int n = (i + t) % frames;
                const ImageF& right = (t % 2 == 0 ? expected : expectedOfTwo)[std::size_t(n)];
                rain.regionsOfInterest(n, {10, 10, 20, 20});
                rain.isIdentity(n);
                if (largestDifference(rain.render(n, whole).pixels, right) != 0) ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace virga::test
