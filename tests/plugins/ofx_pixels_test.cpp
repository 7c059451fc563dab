// What the numbers of a host's images mean: depths, components, alpha, colour.
#include "OfxFixture.h"

namespace virga::test {
namespace {

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

}  // namespace
}  // namespace virga::test
