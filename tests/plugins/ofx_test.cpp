// The OpenFX plug-in in a host that holds it to the standard; its frames against the command line's.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "OfxHost.h"
#include "core/Error.h"
#include "io/ImageFile.h"
#include "io/ImageWrite.h"
#include "virga/virga.h"

namespace virga::test {
namespace {

namespace fs = std::filesystem;

constexpr int width = 96, height = 64, frames = 4;
constexpr const char* filter = ofx::value::contextFilter;
constexpr const char* general = ofx::value::contextGeneral;

/// A street of sorts: a bright sky, a darker ground, detail, and a patch that moves.
ImageF plate(double time)
{
    ImageF image(width, height, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const float sky = y < height / 2 ? 0.9F : 0.15F;
            const float detail = 0.05F * float((x * 7 + y * 13) % 11) / 11;
            const bool isPatch = std::abs(x - 20 - 10 * int(time)) < 6 && std::abs(y - 40) < 6;
            image.at(x, y, 0) = sky * 0.8F + detail + (isPatch ? 0.5F : 0.0F);
            image.at(x, y, 1) = sky * 0.9F + detail;
            image.at(x, y, 2) = sky + detail;
            image.at(x, y, 3) = 1;
        }
    return image;
}

void write(const fs::path& path, const ImageF& image, int channels = 4)
{
    const char* const names[] = {"R", "G", "B", "A"};
    io::ImageToWrite file;
    for (int c = 0; c < channels; ++c)
        file.channels.push_back({channels == 1 ? "Z" : names[c], io::SampleType::Float, image.view(), c});
    io::writeImageFile(path.string(), file);
}

ImageF read(const fs::path& path)
{
    io::ImageHeader header;
    return io::readCodedRgba(path.string(), header);
}

double largestDifference(const ImageF& a, const ImageF& b, int dx = 0, int dy = 0)
{
    double most = 0;
    for (int y = 0; y < a.height(); ++y)
        for (int x = 0; x < a.width(); ++x)
            for (int c = 0; c < 3; ++c)
                most = std::max(most, std::abs(double(a.at(x, y, c)) - double(b.at(x + dx, y + dy, c))));
    return most;
}

/// A host with the plug-in loaded; at the end nothing may have been misused.
class Ofx : public testing::Test {
protected:
    void start(HostKind kind = {})
    {
        stop();
        host_ = std::make_unique<OfxHostOfTests>(kind);
        plugin_ = host_->open(VIRGA_OFX_BINARY);
        ASSERT_NE(plugin_, nullptr) << host_->misuses.front();
        loaded_ = plainAct(ofx::action::load);
    }
    void stop()
    {
        if (!host_) return;
        effects_.clear();
        if (loaded_ == ofx::statOk) {
            EXPECT_EQ(plainAct(ofx::action::unload), ofx::statOk);
        }
        for (const std::string& misuse : host_->misuses) ADD_FAILURE() << misuse;
        host_.reset();
    }
    void TearDown() override
    {
        stop();
        std::error_code error;
        fs::remove_all(folder_, error);
    }
    OfxStatus plainAct(const char* name) { return plugin_->mainEntry(name, nullptr, nullptr, nullptr); }

    HostEffect& effect(const char* context = filter)
    {
        effects_.push_back(std::make_unique<HostEffect>(*host_, *plugin_, context));
        EXPECT_EQ(effects_.back()->describe(), ofx::statOk);
        for (const char* name : {"Source", "Output"}) {
            HostClip& clip = effects_.back()->clip(name);
            clip.region = {0, 0, width, height};
            clip.last = frames - 1;
            clip.frame = plate;
            clip.spareBytes = 8;
        }
        for (const char* name : {"Depth", "Environment"})
            if (effects_.back()->hasClip(name)) effects_.back()->clip(name).isConnected = false;
        return *effects_.back();
    }
    /// As most tests have it: rain alone, so that each pixel's change is a stroke's.
    static void heavyRain(HostEffect& effect)
    {
        effect.set("rate", 80);
        effect.set("seed", 7);
    }

    fs::path folder()
    {
        if (folder_.empty()) {
            std::string pattern = (fs::temp_directory_path() / "virga-ofx-XXXXXX").string();
            folder_ = mkdtemp(pattern.data());
        }
        return folder_;
    }
    /// Frame n of `virga rain` over the same plate.
    std::vector<ImageF> byRain(const std::string& settings)
    {
        for (int n = 0; n < frames; ++n) write(folder() / ("s." + std::to_string(n) + ".exr"), plate(n));
        const std::string command = std::string(VIRGA_PROGRAM) + " rain " + (folder() / "s.%d.exr").string() + " -o " +
                                    (folder() / "r.%d.exr").string() + " --quiet --float --fps 25 --rate 80 --seed 7 " +
                                    settings;
        if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
        std::vector<ImageF> all;
        for (int n = 0; n < frames; ++n) all.push_back(read(folder() / ("r." + std::to_string(n) + ".exr")));
        return all;
    }

    static constexpr OfxRectI whole{0, 0, width, height};
    std::unique_ptr<OfxHostOfTests> host_;
    OfxPlugin* plugin_ = nullptr;
    OfxStatus loaded_ = ofx::statFailed;
    std::vector<std::unique_ptr<HostEffect>> effects_;
    fs::path folder_;
};

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

TEST_F(Ofx, FramesAreThoseOfTheCommandLine)
{
    start();
    const std::vector<ImageF> expected = byRain("");
    for (const char* context : {filter, general}) {
        HostEffect& rain = effect(context);
        heavyRain(rain);
        ASSERT_EQ(rain.create(), ofx::statOk);
        for (const int n : {2, 0, 3, 1}) {
            const auto made = rain.render(n, whole);
            ASSERT_EQ(made.status, ofx::statOk) << host_->messages.back();
            EXPECT_LT(largestDifference(made.pixels, expected[std::size_t(n)]), 2e-6) << "frame " << n;
            EXPECT_GT(largestDifference(made.pixels, plate(n)), 0.01);
        }
    }
}

TEST_F(Ofx, LightOfOneFrameWhereTheHostHasNoOthers)
{
    start({.temporalAccess = false});
    const std::vector<ImageF> expected = byRain("--env-frames 0");
    HostEffect& rain = effect();
    heavyRain(rain);
    ASSERT_EQ(rain.create(), ofx::statOk);
    EXPECT_TRUE(rain.framesNeeded(2).empty());
    EXPECT_LT(largestDifference(rain.render(2, whole).pixels, expected[2]), 2e-6);
    for (const double time : rain.clip("Source").asked) EXPECT_EQ(time, 2);
}

TEST_F(Ofx, FramesNeededAreThoseFetched)
{
    start();
    HostEffect& rain = effect();
    ASSERT_EQ(rain.create(), ofx::statOk);
    std::set<double> said{1};
    for (const auto& [first, last] : rain.framesNeeded(1))
        for (double t = first; t <= last; ++t) said.insert(t);
    EXPECT_EQ(said.size(), std::size_t(frames));  // a clip this short stands for itself
    rain.render(1, whole);
    rain.clip("Source").asked.clear();
    rain.render(1, whole);
    EXPECT_EQ(rain.clip("Source").asked.size(), 1U);  // the others are known by now
    rain.act(ofx::action::beginSequenceRender);
    rain.render(1, whole);
    for (const double time : rain.clip("Source").asked) EXPECT_TRUE(said.contains(time)) << time;
}

TEST_F(Ofx, RegionsAreCropsOfTheWhole)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    rain.set("blur", 2);
    ASSERT_EQ(rain.create(), ofx::statOk);
    for (const double scale : {1.0, 0.5}) {
        const int w = int(width * scale), h = int(height * scale);
        const ImageF full = rain.render(1, {0, 0, w, h}, scale).pixels;
        for (const OfxRectI& window : {OfxRectI{0, 0, 16, 16}, OfxRectI{10, 8, 33, 29}, OfxRectI{w - 7, h - 5, w, h}}) {
            const auto made = rain.render(1, window, scale);
            ASSERT_EQ(made.status, ofx::statOk) << host_->messages.back();
            EXPECT_LT(largestDifference(made.pixels, full, window.x1, h - window.y2), 1e-4)
                << scale << " " << window.x1;
        }
    }
}

TEST_F(Ofx, ProxiesLookLikeTheWhole)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    ASSERT_EQ(rain.create(), ofx::statOk);
    const ImageF full = rain.render(1, whole).pixels, half = rain.render(1, {0, 0, width / 2, height / 2}, 0.5).pixels;
    double ofFull = 0, ofHalf = 0;
    for (std::size_t i = 0; i < full.size(); ++i) ofFull += double(full.data()[i]);
    for (std::size_t i = 0; i < half.size(); ++i) ofHalf += double(half.data()[i]);
    EXPECT_NEAR(ofHalf * 4 / ofFull, 1, 0.01);
}

TEST_F(Ofx, FormatsOfPixels)
{
    start();
    HostEffect& reference = effect();
    heavyRain(reference);
    reference.set("pixels", 1);
    ASSERT_EQ(reference.create(), ofx::statOk);
    const ImageF expected = reference.render(1, whole).pixels;
    for (const char* components : {ofx::value::componentRgba, ofx::value::componentRgb})
        for (const auto& [depth, tolerance] : {std::pair<const char*, double>{ofx::value::depthFloat, 2e-6},
                                               {ofx::value::depthHalf, 2e-3},
                                               {ofx::value::depthShort, 1e-4},
                                               {ofx::value::depthByte, 6e-3}})
            for (const bool rowsGoDown : {false, true}) {
                HostEffect& rain = effect();
                heavyRain(rain);
                rain.set("pixels", 1);  // scene-linear, whatever the depth
                for (const char* name : {"Source", "Output"}) {
                    rain.clip(name).components = components;
                    rain.clip(name).depth = depth;
                    rain.clip(name).rowsGoDown = rowsGoDown;
                }
                rain.clip("Source").frame = [](double t) {
                    ImageF image = plate(t);
                    for (std::size_t i = 0; i < image.size(); ++i) image.data()[i] = std::min(image.data()[i], 1.0F);
                    return image;
                };
                ASSERT_EQ(rain.create(), ofx::statOk);
                const auto made = rain.render(1, whole);
                ASSERT_EQ(made.status, ofx::statOk) << host_->messages.back();
                double most = 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x)
                        for (int c = 0; c < 3; ++c) {
                            if (plate(1).at(x, y, c) > 0.99F) continue;  // clipped on the way in
                            most = std::max(most, std::abs(std::min(double(expected.at(x, y, c)), 1.0) -
                                                           std::min(double(made.pixels.at(x, y, c)), 1.0)));
                        }
                EXPECT_LT(most, tolerance + 2e-3) << components << " " << depth << " " << rowsGoDown;
            }
}

TEST_F(Ofx, EightBitsAreVideoUnlessSaidOtherwise)
{
    start();
    const auto render = [&](double pixels, const char* depth) {
        HostEffect& rain = effect();
        heavyRain(rain);
        rain.set("pixels", pixels);
        for (const char* name : {"Source", "Output"}) rain.clip(name).depth = depth;
        EXPECT_EQ(rain.create(), ofx::statOk);
        return rain.render(1, whole).pixels;
    };
    const ImageF told = render(0, ofx::value::depthByte);
    EXPECT_EQ(largestDifference(told, render(2, ofx::value::depthByte)), 0);
    EXPECT_GT(largestDifference(told, render(1, ofx::value::depthByte)), 0.01);
    EXPECT_EQ(largestDifference(render(0, ofx::value::depthFloat), render(1, ofx::value::depthFloat)), 0);
}

TEST_F(Ofx, StraightAlpha)
{
    start();
    const auto render = [&](bool isStraight) {
        HostEffect& rain = effect();
        heavyRain(rain);
        for (const char* name : {"Source", "Output"})
            rain.clip(name).alpha = isStraight ? ofx::value::unpremultiplied : ofx::value::premultiplied;
        rain.clip("Source").frame = [isStraight](double t) {
            ImageF image = plate(t);
            for (int y = 0; y < height; ++y)
                for (int x = 0; x < width; ++x) {
                    image.at(x, y, 3) = 0.5F;
                    for (int c = 0; c < 3 && !isStraight; ++c) image.at(x, y, c) *= 0.5F;
                }
            return image;
        };
        EXPECT_EQ(rain.create(), ofx::statOk);
        return rain.render(1, whole).pixels;
    };
    const ImageF premultiplied = render(false), straight = render(true);
    double most = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            EXPECT_NEAR(premultiplied.at(x, y, 3), straight.at(x, y, 3), 1e-5);
            for (int c = 0; c < 3; ++c)
                most = std::max(
                    most, double(std::abs(premultiplied.at(x, y, c) - straight.at(x, y, c) * straight.at(x, y, 3))));
        }
    EXPECT_LT(most, 1e-5);
}

TEST_F(Ofx, DepthAndEnvironmentAreThoseOfTheCommandLine)
{
    start();
    ImageF depth(width, height, 4), panorama(64, 32, 4);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 4; ++c) depth.at(x, y, c) = x < width / 2 ? 1.0F : 60.0F;
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 64; ++x)
            for (int c = 0; c < 4; ++c) panorama.at(x, y, c) = c == 3 ? 1.0F : y < 16 ? 2.0F + 0.1F * float(c) : 0.3F;
    for (int n = 0; n < frames; ++n) write(folder() / ("z." + std::to_string(n) + ".exr"), depth, 1);
    write(folder() / "env.exr", panorama, 3);
    const std::string depthFlag = "--depth " + (folder() / "z.%d.exr").string();
    const std::string environmentFlag = " --env " + (folder() / "env.exr").string();
    for (const auto& [components, hasDepth, hasEnvironment] :
         {std::tuple<const char*, bool, bool>{ofx::value::componentAlpha, true, false},
          {ofx::value::componentAlpha, false, true},
          {ofx::value::componentAlpha, true, true},
          {ofx::value::componentRgba, true, true}}) {
        SCOPED_TRACE(std::string(components) + (hasDepth ? " depth" : "") + (hasEnvironment ? " environment" : ""));
        const std::vector<ImageF> expected =
            byRain((hasDepth ? depthFlag : "") + (hasEnvironment ? environmentFlag : ""));
        HostEffect& rain = effect(general);
        heavyRain(rain);
        HostClip& z = rain.clip("Depth");
        z.isConnected = hasDepth;
        z.components = components;
        z.region = {0, 0, width, height};
        z.frame = [&](double) { return depth; };
        HostClip& env = rain.clip("Environment");
        env.isConnected = hasEnvironment;
        env.region = {0, 0, 64, 32};
        env.frame = [&](double) { return panorama; };
        ASSERT_EQ(rain.create(), ofx::statOk);
        const auto made = rain.render(2, whole);
        ASSERT_EQ(made.status, ofx::statOk) << host_->messages.back();
        EXPECT_LT(largestDifference(made.pixels, expected[2]), 1e-5);
        if (!hasDepth || !hasEnvironment) continue;
        const auto regions = rain.regionsOfInterest(2, {10, 10, 20, 20});
        EXPECT_EQ(regions.at("Depth").x2, width);
        EXPECT_EQ(regions.at("Environment").x2, 64);
        EXPECT_LE(regions.at("Source").x1, 10);
        // Without the wall it rains there.
        rain.clip("Depth").hasGone = true;
        EXPECT_EQ(rain.render(2, whole).status, ofx::statFailed);
        EXPECT_NE(host_->messages.back().find("depth"), std::string::npos);
    }
}

TEST_F(Ofx, RegionsOfInterestAreWhatIsFetched)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    ASSERT_EQ(rain.create(), ofx::statOk);
    rain.render(1, whole);  // sets the shot up
    const OfxRectD small{20, 20, 30, 30};
    const OfxRectD plain = rain.regionsOfInterest(1, small).at("Source");
    EXPECT_LE(plain.x1, 20);
    EXPECT_GE(plain.x2, 30);
    EXPECT_LT(plain.x2 - plain.x1, width);  // lit by samples, it does not need the whole frame
    rain.set("blur", 4);
    const OfxRectD blurred = rain.regionsOfInterest(1, small).at("Source");
    EXPECT_LT(blurred.x1, plain.x1);
    EXPECT_GT(blurred.y2, plain.y2);
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

TEST_F(Ofx, LayersAddUp)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    rain.set("ground", "1.5,10");
    rain.set("fog_auto", 0.0);
    rain.set("fog", 0.01);
    ASSERT_EQ(rain.create(), ofx::statOk);
    std::vector<ImageF> layers;
    for (int i = 0; i < 5; ++i) {
        rain.set("output", i);
        layers.push_back(rain.render(1, whole).pixels);
    }
    double most = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 3; ++c) {
                double sum = double(layers[4].at(x, y, c));
                for (const std::size_t layer : {3U, 2U, 1U})
                    sum = double(layers[layer].at(x, y, c)) + (1 - double(layers[layer].at(x, y, 3))) * sum;
                most = std::max(most, std::abs(sum - double(layers[0].at(x, y, c))));
            }
    EXPECT_LT(most, 1e-5);
}

TEST_F(Ofx, TimesAreFrames)
{
    start();
    HostEffect& rain = effect();
    heavyRain(rain);
    rain.clip("Source").frame = [](double) { return plate(0); };
    ASSERT_EQ(rain.create(), ofx::statOk);
    const ImageF second = rain.render(2, whole).pixels;
    EXPECT_EQ(largestDifference(rain.render(2.5, whole).pixels, second), 0);  // a field's time lies in its frame
    EXPECT_GT(largestDifference(rain.render(3, whole).pixels, second), 0.01);
    EXPECT_EQ(rain.render(-5, whole).status, ofx::statOk);
    EXPECT_EQ(largestDifference(rain.render(2, whole).pixels, second), 0);
}

TEST_F(Ofx, FramesThatLieElsewhere)
{
    start();
    HostEffect &rain = effect(), &moved = effect();
    for (HostEffect* one : {&rain, &moved}) heavyRain(*one);
    for (const char* name : {"Source", "Output"}) moved.clip(name).region = {-40, 30, width - 40, height + 30};
    ASSERT_EQ(rain.create(), ofx::statOk);
    ASSERT_EQ(moved.create(), ofx::statOk);
    EXPECT_EQ(
        largestDifference(rain.render(1, whole).pixels, moved.render(1, {-40, 30, width - 40, height + 30}).pixels), 0);
}

TEST_F(Ofx, OverscanIsOutsideTheCamera)
{
    start();
    const ImageF expected = [&] {
        HostEffect& rain = effect();
        heavyRain(rain);
        EXPECT_EQ(rain.create(), ofx::statOk);
        return rain.render(1, whole).pixels;
    }();
    constexpr int more = 12;
    HostEffect& rain = effect();
    heavyRain(rain);
    rain.set("frame", 1);
    ASSERT_EQ(rain.create(), ofx::statOk);  // in a project of the frame's size
    const auto wide = [](double t) {
        const ImageF inner = plate(t);
        ImageF image(width + 2 * more, height + 2 * more, 4);
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < image.width(); ++x)
                std::copy_n(inner.pixel(std::clamp(x - more, 0, width - 1), std::clamp(y - more, 0, height - 1)), 4,
                            image.pixel(x, y));
        return image;
    };
    rain.clip("Source").region = {-more, -more, width + more, height + more};
    rain.clip("Source").frame = wide;
    const auto all = rain.render(1, {-more, -more, width + more, height + more});
    ASSERT_EQ(all.status, ofx::statOk) << host_->messages.back();
    EXPECT_LT(largestDifference(expected, all.pixels, more, more), 1e-4);
    double outside = 0;
    const ImageF dry = wide(1);
    for (int y = 0; y < dry.height(); ++y)
        for (int x = 0; x < more; ++x)
            outside = std::max(outside, std::abs(double(dry.at(x, y, 0) * 0.9F - all.pixels.at(x, y, 0))));
    EXPECT_GT(outside, 0.01);
    EXPECT_LT(largestDifference(rain.render(1, whole).pixels, expected), 1e-4);
    // A source that is less than the project: the rest is rain over nothing.
    rain.clip("Source").region = {16, 0, width, height};
    rain.clip("Source").frame = [](double t) {
        const ImageF frame = plate(t);
        ImageF part(width - 16, height, 4);
        for (int y = 0; y < height; ++y) std::copy_n(frame.pixel(16, y), 4 * (width - 16), part.pixel(0, y));
        return part;
    };
    EXPECT_EQ(rain.render(1, whole).status, ofx::statOk);
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

TEST_F(Ofx, HostsThatManageColour)
{
    start({.managesColour = true});
    HostEffect& rain = effect(general);
    EXPECT_EQ(rain.description().text(ofx::prop::colourStyle), ofx::value::colourBasic);
    heavyRain(rain);
    for (const char* name : {"Source", "Output"}) {
        rain.clip(name).depth = ofx::value::depthShort;
        rain.clip(name).colourspace = ofx::value::sceneLinear;
    }
    ASSERT_EQ(rain.create(), ofx::statOk);
    PropertySet preferences("out preferences"), space("out colourspace");
    EXPECT_EQ(rain.act(ofx::action::getClipPreferences, nullptr, &preferences), ofx::statOk);
    EXPECT_EQ(preferences.text("OfxImageClipPropPreferredColourspaces_Source"), ofx::value::sceneLinear);
    EXPECT_EQ(rain.act(ofx::action::getOutputColourspace, nullptr, &space), ofx::statOk);
    EXPECT_EQ(space.text(ofx::prop::clipColourspace), ofx::value::colourOfSource);
    // What the host says outranks what the depth suggests.
    const ImageF told = rain.render(1, whole).pixels;
    HostEffect& chosen = effect();
    heavyRain(chosen);
    chosen.set("pixels", 1);
    for (const char* name : {"Source", "Output"}) chosen.clip(name).depth = ofx::value::depthShort;
    ASSERT_EQ(chosen.create(), ofx::statOk);
    EXPECT_EQ(largestDifference(told, chosen.render(1, whole).pixels), 0);
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
