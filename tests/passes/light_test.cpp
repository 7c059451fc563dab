#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "Picture.h"
#include "optics/DropTransfer.h"
#include "sh/Harmonics.h"
#include "sh/Panorama.h"
#include "support/ShaderLookup.h"

namespace virga::passes {
namespace {

constexpr double pi = std::numbers::pi;

class Light : public testing::Test {
protected:
    gl::Context context{"auto"};
    void TearDown() override { EXPECT_NO_THROW(context.check("the test")); }
};

ImageF paint(int width, int height, const std::function<glm::dvec3(const glm::dvec3&)>& radiance)
{
    ImageF map(width, height, 3);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 c = radiance(sh::panoramaDirection(x + 0.5, y + 0.5, width, height));
            for (int k = 0; k < 3; ++k) map.at(x, y, k) = float(c[k]);
        }
    }
    return map;
}

/// Maps as drops make them: a cosine lobe and a sky through harmonics, and a sun through D by rings of its width.
struct NamedMap {
    const char* name;
    ImageF map;
};
std::vector<NamedMap> dropMaps()
{
    const glm::dvec3 a = glm::normalize(glm::dvec3(0.3, 0.8, 0.5)), sun = glm::normalize(glm::dvec3(0.5, 0.7, -0.4));
    const std::vector<double> f = optics::zonalCoefficients(16);
    const auto throughDrops = [&](const ImageF& environment, int width) {
        sh::Harmonics h = sh::projectPanorama(environment, 16);
        sh::convolve(h, {f, f, f});
        return sh::bakePanorama(h, width, width / 2);
    };
    std::vector<NamedMap> maps;
    maps.push_back({"constant", paint(64, 32, [](auto) { return glm::dvec3(1.0, 0.5, 3.0); })});
    maps.push_back(
        {"cosine",
         throughDrops(
             paint(256, 128, [&](const glm::dvec3& d) { return glm::dvec3(0.05 + std::max(0.0, glm::dot(a, d))); }),
             192)});
    const optics::RingTransfer ring;
    ImageF sunny = throughDrops(
        paint(256, 128, [](const glm::dvec3& d) { return glm::dvec3(d.y >= 0 ? 1 - 0.6 * d.y : 0.2); }), 2048);
    for (int y = 0; y < sunny.height(); ++y) {
        for (int x = 0; x < sunny.width(); ++x) {
            const glm::dvec3 d = sh::panoramaDirection(x + 0.5, y + 0.5, sunny.width(), sunny.height());
            const double more = 7 * ring.mean(std::acos(std::clamp(glm::dot(d, sun), -1.0, 1.0)), 0.0045);
            for (int k = 0; k < 3; ++k) sunny.at(x, y, k) += float(more);
        }
    }
    maps.push_back({"sun and sky", std::move(sunny)});
    return maps;
}

// The lookup that the pass makes, along 10,000 directions, beside sh::sampleMap in double precision.
TEST_F(Light, ShaderAndCpuLookUpTheSame)
{
    const virga::test::ShaderLookup lookup;
    const std::vector<glm::vec3> directions = virga::test::scatteredDirections(10000);
    for (const NamedMap& named : dropMaps()) {
        const std::vector<glm::vec4> found = lookup(named.map, directions);
        double worst = 0.0;
        for (std::size_t i = 0; i < directions.size(); ++i) {
            const glm::dvec3 expected = sh::sampleMap(named.map, directions[i]);
            for (int c = 0; c < 3; ++c) {
                worst = std::max(worst, std::abs(double(found[i][c]) - expected[c]) / expected[c]);
            }
        }
        RecordProperty(named.name, std::to_string(worst));
        EXPECT_LT(worst, 1e-4) << named.name;
    }
}

TEST_F(Light, TheLookupTurnsWithTheEnvironment)
{
    const virga::test::ShaderLookup lookup;
    const ImageF map = dropMaps()[2].map;
    const glm::dmat3 turn = glm::mat3_cast(glm::angleAxis(1.1, glm::normalize(glm::dvec3(1, 2, -3))));
    const std::vector<glm::vec3> directions = virga::test::scatteredDirections(1000);
    const std::vector<glm::vec4> found = lookup(map, directions, glm::mat3(turn));
    for (std::size_t i = 0; i < directions.size(); ++i) {
        const glm::dvec3 expected = sh::sampleMap(map, turn * glm::dvec3(directions[i]));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[i][c] / expected[c], 1.0, 1e-3) << i;
    }
}

// A uniform world stays uniform through the pass and the composite: every drop over every plate.
TEST_F(Light, AWhiteWorldIsWhite)
{
    for (const int width : {64, 512, 2048}) {
        for (const float radiance : {1.0f, 0.18f, 40.0f}) {
            for (const float boost : {0.0f, 0.7f}) {
                test::Picture picture(64, 48, {.rain = true, .fog = true, .boost = boost > 0});
                const ImageF white(width, width / 2, 3, radiance);
                picture.targets.uploadDropRadiance(white, white);
                picture.targets.uploadFogTable(std::vector<float>(shared::fogTableSize, 0.3f));
                picture.constants.boost = {boost, 0, 0.3f, 0};
                const ImageF beauty = picture.render(
                    test::opaque(64, 48, radiance, radiance, radiance),
                    picture.listOf({{{10, 5}, {12, 40}, 6}, {{30.5, 0}, {30.5, 48}, 2}, {{50, 9}, {60, 9}, 0.3}}));
                for (int y = 0; y < 48; ++y)
                    for (int x = 0; x < 64; ++x)
                        for (int c = 0; c < 3; ++c)
                            ASSERT_NEAR(beauty.at(x, y, c) / radiance, 1, 1e-6) << width << " " << x << " " << y;
            }
        }
    }
}

TEST_F(Light, TheGridIsAsFineAsItsMap)
{
    const auto step = [&](int pictureWidth, int mapWidth) {
        test::Picture picture(pictureWidth, 16, {.rain = true});  // a focal length of 500 px
        const ImageF map(mapWidth, mapWidth / 2, 3, 1.0f);
        picture.targets.uploadDropRadiance(map, map);
        picture.render(ImageF(pictureWidth, 16, 4));
        EXPECT_EQ(picture.targets.lightGrid.width(), pictureWidth / picture.targets.lightGridStep() + 2);
        return picture.targets.lightGridStep();
    };
    EXPECT_EQ(step(64, 128), 16);  // 2.8 degrees are 25 px
    EXPECT_EQ(step(64, 256), 8);   // 12 px
    EXPECT_EQ(step(64, 512), 4);   // 6 px
    EXPECT_EQ(step(64, 2048), 4);
}

// What the composite makes of the grid, beside the map along each pixel's own direction.
TEST_F(Light, ThePictureFollowsAFineMap)
{
    const std::vector<NamedMap> maps = dropMaps();
    for (const NamedMap& named : maps) {
        test::Picture picture(320, 240, {.fog = true});
        picture.targets.uploadDropRadiance(named.map, named.map);
        picture.constants.boost.z = 60;  // nothing but the light of drops
        const ImageF beauty = picture.render(ImageF(320, 240, 4));
        double square = 0.0, mean = 0.0;
        for (int y = 0; y < 240; ++y) {
            for (int x = 0; x < 320; ++x) {
                const glm::dvec3 d((x + 0.5 - 160) / 500, -(y + 0.5 - 120) / 500, -1);
                const glm::dvec3 expected = sh::sampleMap(named.map, d);
                mean += expected.g / (320 * 240);
                square += (beauty.at(x, y, 1) - expected.g) * (beauty.at(x, y, 1) - expected.g) / (320 * 240);
            }
        }
        EXPECT_LT(std::sqrt(square) / mean, 0.004) << named.name;
    }
}

}  // namespace
}  // namespace virga::passes
