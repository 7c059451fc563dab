#include "Picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include "grade/ColorTransfer.h"
#include "grade/Darken.h"
#include "particles/CellHash.h"
#include "passes/SplashPass.h"
#include "rainfall/DropSizes.h"

namespace virga::passes {
namespace {

using test::Picture;

class Pictures : public testing::Test {
protected:
    gl::Context context{"cpu"};
    void TearDown() override { EXPECT_NO_THROW(context.check("the test")); }
};

/// Optical depth at the places of the fog table, as the composite reads it.
template <class OpticalDepth>
std::vector<float> fogTable(OpticalDepth&& opticalDepth, double scale = 20)
{
    std::vector<float> table(shared::fogTableSize);
    for (int i = 0; i < shared::fogTableSize; ++i) {
        const double place = double(i) / (shared::fogTableSize - 1);
        table[std::size_t(i)] = float(opticalDepth(place < 1 ? scale * place / (1 - place) : INFINITY));
    }
    return table;
}

particles::CellList someRain(const Picture& picture, double rate = 60)
{
    const rainfall::DropSizes sizes(rate);
    const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(),
                                     particles::Motion({.wind = {4, 0}}), 5);
    particles::Exposure exposure;
    exposure.duration_s = 0.01;
    exposure.projection = {picture.targets.width(), picture.targets.height(), double(Picture::focal)};
    return field.cellsInView(exposure, {.near_m = 0.3, .far_m = 12, .threshold = 1e-4});
}

// White world, drops that keep energy, white fog: nothing to be seen, through every term of the composite.
TEST_F(Pictures, WhiteFurnace)
{
    for (const bool boost : {false, true})
        for (const bool withDepth : {false, true}) {
            Picture picture(128, 96, {.rain = true, .fog = true, .depth = withDepth, .boost = boost, .layers = true});
            picture.constants.boost = {boost ? 0.7f : 0.0f, 0, 0.8f, 0};
            picture.constants.range.w = 3;
            picture.targets.uploadFogTable(fogTable([](double d) { return 0.05 * std::min(d, 200.0); }));
            if (withDepth) {
                ImageF depth(128, 96, 1, INFINITY);
                for (std::size_t i = 0; i < depth.size(); i += 2) depth.data()[i] = 0.01f * float(i);
                picture.targets.uploadDepth(depth);
            }
            const ImageF beauty = picture.render(test::opaque(128, 96, 1, 1, 1), someRain(picture));
            EXPECT_GT(picture.strokeCount(), 1000u);
            const auto [least, most] = std::minmax_element(beauty.values().begin(), beauty.values().end());
            EXPECT_NEAR(*least, 1, 2e-6);
            EXPECT_NEAR(*most, 1, 2e-6);
        }
}

TEST_F(Pictures, FogFollowsBeerAndLambert)
{
    const double sigma = 0.013, far = 300;
    Picture picture(16, 8, {.fog = true, .depth = true, .layers = true});
    picture.targets.uploadFogTable(fogTable([&](double d) { return sigma * std::min(d, far); }));
    picture.constants.fogColor = {0.2f, 0.4f, 0.8f, 1};
    const std::array<float, 8> depths = {0.001f, 0.5f, 3, 17.3f, 60, 150, 290, INFINITY};
    ImageF depth(16, 8, 1);
    for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 16; ++x) depth.at(x, y) = depths[std::size_t(y)];
    picture.targets.uploadDepth(depth);
    const ImageF beauty = picture.render(test::opaque(16, 8, 3, 0, 0.1f));
    for (int y = 0; y < 8; ++y) {
        const double clear = std::exp(-sigma * std::min(double(depths[std::size_t(y)]), far));
        EXPECT_NEAR(beauty.at(5, y, 0), 3 * clear + 0.2 * (1 - clear), 1e-3) << depths[std::size_t(y)];
        EXPECT_NEAR(beauty.at(5, y, 1), 0.4 * (1 - clear), 1e-3);
        EXPECT_NEAR(beauty.at(5, y, 2), 0.1 * clear + 0.8 * (1 - clear), 1e-3);
        EXPECT_NEAR(beauty.at(5, y, 3), 1, 1e-6);
    }
    // Without depth the whole plate stands behind one optical depth.
    Picture flat(16, 8, {.fog = true, .layers = true});
    flat.targets.uploadFogTable(fogTable([](double) { return 0.0; }));
    flat.constants.fogColor = {1, 1, 1, 1};
    flat.constants.boost.z = 0.7f;
    EXPECT_NEAR(flat.render(ImageF(16, 8, 4)).at(3, 3, 0), 1 - std::exp(-0.7), 1e-6);
}

// A stroke far away in fog takes on the fog's colour, and what it hides is hidden all the same.
TEST_F(Pictures, FogLiesOverStrokesByTheirOwnDepth)
{
    Picture picture(64, 64, {.rain = true, .fog = true, .layers = true}, 0);
    picture.targets.uploadFogTable(fogTable([](double d) { return 0.1 * std::min(d, 1e3); }));
    picture.constants.fogColor = {0, 1, 0, 1};
    picture.constants.boost.z = 0.5f;
    for (const double depth : {1.0, 8.0, 30.0}) {
        picture.render(ImageF(64, 64, 4), picture.listOf({{{32.5, 10}, {32.5, 54}, 8, depth}}));
        const ImageF rain = picture.targets.readLayer(FrameTargets::LayerIndex::Rain);
        const float* p = rain.pixel(32, 32);
        ASSERT_GT(p[3], 0.01f);
        EXPECT_NEAR(p[0] / p[3], std::exp(-0.1 * depth), 2e-3) << depth;  // the drop's light, white
        EXPECT_NEAR(p[1] / p[3], 1, 2e-3) << depth;                       // its own green, and the fog's
    }
}

ImageF layersOver(const FrameTargets& targets, const Features& features)
{
    ImageF picture = targets.readLayer(FrameTargets::LayerIndex::Plate);
    const auto over = [&](const ImageF& front) {
        for (std::size_t i = 0; i < picture.size(); i += 4) {
            const float alpha = front.data()[i + 3];
            for (std::size_t c = 0; c < 4; ++c)
                picture.data()[i + c] = front.data()[i + c] + (1 - alpha) * picture.data()[i + c];
        }
    };
    if (features.fog) over(targets.readLayer(FrameTargets::LayerIndex::Fog));
    if (features.rain) over(targets.readLayer(FrameTargets::LayerIndex::Rain));
    return picture;
}

TEST_F(Pictures, LayersAddUpToTheBeauty)
{
    Picture picture(128, 96, {.rain = true, .fog = true, .blur = true, .darken = true, .layers = true});
    picture.targets.uploadFogTable(fogTable([](double d) { return 0.02 * std::min(d, 200.0); }));
    picture.constants.boost.z = 1;
    picture.constants.grade = {0.3f, 0.5f, 2, 50};
    ImageF plate(128, 96, 4);
    for (std::size_t i = 0; i < plate.size(); ++i)
        plate.data()[i] = i % 4 == 3 ? 1.0f : float(particles::unitDouble(particles::mix(i)));
    const ImageF beauty = picture.render(plate, someRain(picture));
    const ImageF sum = layersOver(picture.targets, picture.features);
    for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_NEAR(sum.data()[i], beauty.data()[i], 1e-6f);
}

TEST_F(Pictures, BlurKeepsAConstantAndGrowsWithDepth)
{
    Picture picture(96, 32, {.depth = true, .blur = true, .layers = true});
    picture.constants.grade = {0, 0, 3, 50};
    ImageF depth(96, 32, 1);
    for (std::size_t i = 0; i < depth.size(); ++i) depth.data()[i] = 0.1f + float(i % 97);
    picture.targets.uploadDepth(depth);
    const ImageF constant = picture.render(test::opaque(96, 32, 0.3f, 0.3f, 0.3f));
    for (std::size_t i = 0; i < constant.size(); ++i) ASSERT_NEAR(constant.data()[i], i % 4 == 3 ? 1.0f : 0.3f, 3e-6f);

    // A line on one depth becomes the Gaussian of that depth, sampled and cut at 3 sigma.
    ImageF line = test::opaque(96, 32, 0, 0, 0);
    for (int y = 0; y < 32; ++y) line.at(48, y, 0) = 1;
    for (const float metres : {5.0f, 40.0f, INFINITY}) {
        picture.targets.uploadDepth(test::uniform(96, 32, 1, metres));
        const ImageF blurred = picture.render(line);
        double sum = 0, variance = 0;
        for (int x = 0; x < 96; ++x) {
            sum += double(blurred.at(x, 16, 0));
            variance += double(blurred.at(x, 16, 0)) * (x - 48) * (x - 48);
        }
        const double sigma = 3 * (1 - std::exp(-double(metres) / 50));
        EXPECT_NEAR(sum, 1, 1e-5) << metres;
        double weights = 0, squares = 0;
        for (int k = -int(std::ceil(3 * sigma)); k <= int(std::ceil(3 * sigma)); ++k) {
            weights += std::exp(-0.5 * k * k / (sigma * sigma));
            squares += k * k * std::exp(-0.5 * k * k / (sigma * sigma));
        }
        EXPECT_NEAR(variance / sum, squares / weights, 1e-3) << metres;
    }
}

TEST_F(Pictures, BlurDoesNotBleedOverAnEdgeOfDepth)
{
    Picture picture(64, 16, {.depth = true, .blur = true});
    picture.constants.grade = {0, 0, 6, 50};
    ImageF depth(64, 16, 1, 0.2f), plate = test::opaque(64, 16, 0, 0, 1);
    for (int y = 0; y < 16; ++y)
        for (int x = 32; x < 64; ++x) {
            depth.at(x, y) = INFINITY;
            plate.at(x, y, 0) = 1, plate.at(x, y, 2) = 0;
        }
    picture.targets.uploadDepth(depth);
    const ImageF blurred = picture.render(plate);
    for (int x = 0; x < 64; ++x) EXPECT_NEAR(blurred.at(x, 8, x < 32 ? 0 : 2), 0, 1e-3) << x;
}

// A bright pixel sharper than what is around it leaves in its row what the sum over both directions does, but for that
// row's weights adding up to less than the others': a sixth. By sigma over sigma, not squared, it would be 2.9 times
// it.
TEST_F(Pictures, BlurSpreadsASharpPixelAlongItsRow)
{
    constexpr int size = 33, middle = size / 2;
    Picture picture(size, size, {.depth = true, .blur = true});
    picture.constants.grade = {0, 0, 2, 50};
    ImageF depth(size, size, 1, INFINITY), plate = test::opaque(size, size, 0, 0, 0);
    depth.at(middle, middle) = 25;
    plate.at(middle, middle, 0) = 1;
    picture.targets.uploadDepth(depth);
    const ImageF blurred = picture.render(plate);
    const double own = 2, sharp = own * -std::expm1(-25.0 / 50);
    const auto weight = [](double d2, double sigma) { return std::exp(-0.5 * d2 / (sigma * sigma)); };
    for (int away = 1; away <= 2; ++away) {
        double sum = 0;
        for (int j = -6; j <= 6; ++j)
            for (int i = -6; i <= 6; ++i) sum += weight(i * i + j * j, own);
        const double light = std::pow(sharp / own, 2) * weight(away * away, sharp);
        sum += light - weight(away * away, own);
        EXPECT_NEAR(double(blurred.at(middle + away, middle, 0)) / (light / sum), 1, 0.2) << away;
    }
}

std::vector<std::array<float, 3>> difficultColors()
{
    std::vector<std::array<float, 3>> colors;
    const std::array<float, 12> values = {-2, -0.1f, -1e-4f, 0, 1e-6f, 0.003f, 0.02f, 0.18f, 0.7f, 1, 4, 60};
    for (std::size_t i = 0; i < values.size(); ++i)
        for (std::size_t j = 0; j < values.size(); ++j)
            colors.push_back({values[i], values[j], values[(i * 5 + j * 7) % 12]});
    return colors;
}

/// Each colour as a pixel of a row, opaque; below it at half cover, premultiplied.
ImageF asPlate(const std::vector<std::array<float, 3>>& colors)
{
    ImageF plate(int(colors.size()), 2, 4);
    for (int x = 0; x < plate.width(); ++x)
        for (int row = 0; row < 2; ++row) {
            const float alpha = row == 0 ? 1.0f : 0.5f;
            for (int c = 0; c < 3; ++c) plate.at(x, row, c) = alpha * colors[std::size_t(x)][std::size_t(c)];
            plate.at(x, row, 3) = alpha;
        }
    return plate;
}

TEST_F(Pictures, DarkeningEqualsItsTwin)
{
    const auto colors = difficultColors();
    Picture picture(int(colors.size()), 2, {.darken = true});
    for (const auto& [darken, desaturate] :
         {std::array{0.0f, 0.5f}, std::array{0.4f, 0.0f}, std::array{0.25f, 1.0f}, std::array{1.0f, 0.3f}}) {
        picture.constants.grade = {darken, desaturate, 0, 50};
        const ImageF out = picture.render(asPlate(colors));
        for (int x = 0; x < out.width(); ++x)
            for (int row = 0; row < 2; ++row) {
                const double alpha = row == 0 ? 1 : 0.5;
                const auto& color = colors[std::size_t(x)];
                const auto expected =
                    grade::darkened({alpha * double(color[0]), alpha * double(color[1]), alpha * double(color[2])},
                                    {.desaturate = double(desaturate), .darken = double(darken)});
                const double largest = std::max({std::abs(color[0]), std::abs(color[1]), std::abs(color[2]), 1.0f});
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(out.at(x, row, c), expected[std::size_t(c)], 1e-6 * largest) << x;
                EXPECT_EQ(out.at(x, row, 3), float(alpha));
            }
    }
}

TEST_F(Pictures, ColorTransferEqualsItsTwin)
{
    grade::ColorLut lut;
    lut.size = 9;
    lut.maximum = 4;
    for (std::size_t i = 0; i < 3 * 9 * 9 * 9; ++i)
        lut.rgb.push_back(float(0.1 * (particles::unitDouble(particles::mix(i)) - 0.5)));
    const auto colors = difficultColors();
    Picture picture(int(colors.size()), 2, {.colorTransfer = true});
    picture.targets.uploadLut(lut.size, lut.rgb);
    picture.constants.lut = {lut.delta, lut.maximum, float(lut.size), 0};
    const ImageF out = picture.render(asPlate(colors));
    for (int x = 0; x < out.width(); ++x)
        for (int row = 0; row < 2; ++row) {
            const double alpha = row == 0 ? 1 : 0.5;
            const auto& color = colors[std::size_t(x)];
            const auto expected = grade::apply(lut, {double(color[0]), double(color[1]), double(color[2])});
            for (int c = 0; c < 3; ++c) {
                const double value = alpha * expected[std::size_t(c)];
                EXPECT_NEAR(out.at(x, row, c), value, 1e-5 * std::max(1.0, std::abs(value)))
                    << color[0] << ", " << color[1] << ", " << color[2];
            }
        }
}

// The one struct that C++ and GLSL share by hand-counted rows: where the driver puts each member.
TEST_F(Pictures, ConstantsLieWhereTheDriverReadsThem)
{
    using C = shared::FrameConstants;
    const gl::Program program("pass_composite.comp", {{"RAIN", ""},
                                                      {"FOG", ""},
                                                      {"DEPTH", ""},
                                                      {"SPLASHES", ""},
                                                      {"BOOST", ""},
                                                      {"DARKEN", ""},
                                                      {"COLOR_TRANSFER", ""},
                                                      {"LAYERS", ""}});
    const auto offsetOf = [&](const char* member) {
        const std::string name = std::string("FrameBlock.frame.") + member;
        for (const std::string& spelled : {name, std::string("frame.") + member}) {
            const GLuint index = glGetProgramResourceIndex(program.name(), GL_BUFFER_VARIABLE, spelled.c_str());
            if (index == GL_INVALID_INDEX) continue;
            const GLenum what = GL_OFFSET;
            GLint offset = -1;
            glGetProgramResourceiv(program.name(), GL_BUFFER_VARIABLE, index, 1, &what, 1, nullptr, &offset);
            return offset;
        }
        ADD_FAILURE() << "the program has no " << name;
        return -1;
    };
    EXPECT_EQ(offsetOf("lens"), GLint(offsetof(C, lens)));
    EXPECT_EQ(offsetOf("picture"), GLint(offsetof(C, picture)));
    EXPECT_EQ(offsetOf("fogColor"), GLint(offsetof(C, fogColor)));
    EXPECT_EQ(offsetOf("boost"), GLint(offsetof(C, boost)));
    EXPECT_EQ(offsetOf("grade"), GLint(offsetof(C, grade)));
    EXPECT_EQ(offsetOf("lut"), GLint(offsetof(C, lut)));
}

TEST_F(Pictures, NothingIsMadeThatNoFeatureNeeds)
{
    const FrameTargets graded(16, 16, {.darken = true});
    EXPECT_TRUE(bool(graded.plate));
    EXPECT_FALSE(graded.blurA || graded.blurB || graded.lightGrid || graded.lowPassGrid);
    EXPECT_EQ(graded.nearestDepth.name(), 0u);
    EXPECT_EQ(graded.nearestMotion.name(), 0u);
    const FrameTargets rainy(16, 16, {.rain = true});
    EXPECT_TRUE(bool(rainy.lightGrid));
    EXPECT_FALSE(rainy.blurA || rainy.lowPassGrid);
    EXPECT_TRUE(bool(FrameTargets(16, 16, {.rain = true, .boost = true}).lowPassGrid));
    EXPECT_TRUE(bool(FrameTargets(16, 16, {.blur = true}).blurB));
}

// Each feature alone, all together, all but one: every variant compiles.
TEST_F(Pictures, VariantsCompile)
{
    const auto featuresOf = [](unsigned bits) {
        Features f;
        f.rain = bits & 1, f.fog = bits & 2, f.depth = bits & 4, f.splashes = bits & 8, f.blur = bits & 16,
        f.darken = bits & 32;
        f.colorTransfer = bits & 64, f.boost = bits & 128, f.layers = bits & 256, f.cameraMotion = bits & 512;
        f.nearest = (bits & 1024) && f.rain, f.lights = bits & 2048, f.software = bits & 4096;
        return f;
    };
    constexpr unsigned all = 8191;
    std::vector<unsigned> variants = {all};
    for (unsigned bit = 1; bit < all; bit *= 2) variants.insert(variants.end(), {bit, all & ~bit});
    const matte::StrokeAtlas atlas = matte::makeOscillatingDropAtlas(1, {.groups = 1, .variants = 2, .liveliness = 0});
    for (const unsigned bits : variants) {
        const Features features = featuresOf(bits);
        EXPECT_NO_THROW({
            CompositePass composite(features);
            if (features.rain) StrokePass strokes(features, atlas);
            if (features.splashes) SplashPass splashes(features);
            if (features.blur) BlurPass blur(features);
            if (features.light()) LightPass light(features);
        }) << bits;
    }
}

TEST_F(Pictures, LightIsLookedUpWhereThePixelLooks)
{
    // Radiance that tells its direction: x, y, z of it as colour.
    ImageF map(512, 256, 3);
    for (int y = 0; y < 256; ++y)
        for (int x = 0; x < 512; ++x) {
            const double azimuth = ((x + 0.5) / 512 - 0.5) * 2 * M_PI, up = (0.5 - (y + 0.5) / 256) * M_PI;
            const double d[3] = {std::cos(up) * std::sin(azimuth), std::sin(up), -std::cos(up) * std::cos(azimuth)};
            for (int c = 0; c < 3; ++c) map.at(x, y, c) = float(1 + d[c]);
        }
    Picture picture(320, 240, {.rain = true, .layers = true}, 0);
    picture.targets.uploadDropRadiance(map, map);
    for (const auto& px : {glm::dvec2(160, 120), glm::dvec2(30, 40), glm::dvec2(300, 200)}) {
        picture.render(ImageF(320, 240, 4), picture.listOf({{px - glm::dvec2(0, 20), px + glm::dvec2(0, 20), 6}}));
        const ImageF rain = picture.targets.readLayer(FrameTargets::LayerIndex::Rain);
        const float* p = rain.pixel(int(px.x), int(px.y));
        const glm::dvec3 ray = glm::normalize(glm::dvec3((px.x - 160) / 500, -(px.y - 120) / 500, -1));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(p[c] / p[3] - 1, ray[c], 5e-3) << px.x;
    }
}

}  // namespace
}  // namespace virga::passes
