// The OpenFX plug-in's frames: the command line's, in regions, proxies, layers, wherever they lie.
#include "OfxFixture.h"

namespace virga::test {
namespace {

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
    EXPECT_EQ(largestDifference(rain.render(2 + 1e-9, whole).pixels, second), 0);
    const ImageF between = rain.render(2.5, whole).pixels;  // of a retimed clip
    EXPECT_GT(largestDifference(between, second), 0.01);
    EXPECT_EQ(largestDifference(rain.render(2.5, whole).pixels, between), 0);
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

}  // namespace
}  // namespace virga::test
