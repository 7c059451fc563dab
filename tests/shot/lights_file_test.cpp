#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "shot/LightsFile.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

using test::sentenceOf;
using test::TemporaryFolder;

TEST(LightsFile, ReadsIntensities)
{
    const TemporaryFolder folder;
    const auto lights = readLights(folder.write("lamps.toml",
                                                "[[light]]\n"
                                                "name = \"door\"\n"
                                                "position = [-3.25, 4.4, -12]\n"
                                                "intensity = [0.75, 0.5, 0]\n"
                                                "[[light]]\n"
                                                "position = [0, 2, 1e3]\n"
                                                "intensity = [1, 2, 3]\n"
                                                "radius_m = 0.5\n"));
    ASSERT_EQ(lights.size(), 2u);
    EXPECT_EQ(lights[0].name, "door");
    EXPECT_EQ(lights[0].position, glm::dvec3(-3.25, 4.4, -12.0));
    EXPECT_EQ(lights[0].intensity, glm::dvec3(0.75, 0.5, 0.0));
    EXPECT_EQ(lights[0].radius_m, 0.05);
    EXPECT_EQ(lights[1].name, "");
    EXPECT_EQ(lights[1].position, glm::dvec3(0.0, 2.0, 1000.0));
    EXPECT_EQ(lights[1].radius_m, 0.5);
}

// A sphere of radiance L shows the disc pi r^2 to everybody.
TEST(LightsFile, ReadsASpheresRadiance)
{
    const TemporaryFolder folder;
    const auto lights = readLights(
        folder.write("lamps.toml", "[[light]]\nposition = [1, 2, 3]\nradiance = [9, 6, 3]\nradius_m = 0.1\n"));
    ASSERT_EQ(lights.size(), 1u);
    for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(lights[0].intensity[channel], (9.0 - 3.0 * channel) * std::numbers::pi * 0.01, 1e-15);
    EXPECT_EQ(lights[0].radius_m, 0.1);
}

TEST(LightsFile, WithoutLightsHasNone)
{
    const TemporaryFolder folder;
    EXPECT_TRUE(readLights(folder.write("none.toml", "# nothing yet\n")).empty());
    EXPECT_TRUE(readLights(folder.write("none.toml", "light = []\n")).empty());
}

TEST(LightsFile, TakesSixteen)
{
    const TemporaryFolder folder;
    std::string text;
    for (std::size_t i = 0; i < maxSceneLights; ++i) text += "[[light]]\nposition=[0,0,0]\nintensity=[1,1,1]\n";
    EXPECT_EQ(readLights(folder.write("lamps.toml", text)).size(), maxSceneLights);
    const std::string path = folder.write("lamps.toml", text + "[[light]]\nposition=[0,0,0]\nintensity=[1,1,1]\n");
    const std::string sentence = sentenceOf(ErrorCode::Input, [&] { readLights(path); });
    EXPECT_SAYS(sentence, path);
    EXPECT_SAYS(sentence, "line 49: 17 [[light]]s: at most 16 are allowed");
}

TEST(LightsFile, SaysWhatIsWrong)
{
    const TemporaryFolder folder;
    const std::string start = "[[light]]\nposition = [0, 3, 0]\n";
    const struct {
        std::string text, sentence;
    } cases[] = {
        {start, "line 1: a [[light]] without 'intensity': must be [r, g, b], or 'radiance' with 'radius_m'"},
        {"[[light]]\nintensity = [1, 1, 1]\n", "line 1: a [[light]] without 'position': must be [x, y, z] in metres"},
        {start + "intensity = [1, -2, 1]\n",
         "line 3: 'intensity' = [1, -2, 1]: must be a list of three numbers, each 0 to 1000000000"},
        {start + "intensity = [1, nan, 1]\n", "line 3: 'intensity' = [1, nan, 1]: must be a list of three numbers"},
        {start + "intensity = [1, 1]\n", "line 3: 'intensity' = [1, 1]: must be a list of three numbers"},
        {start + "intensity = 5\n", "line 3: 'intensity' = 5: must be a list of three numbers"},
        {start + "intensity = [1, 1, \"bright\"]\n", "must be a list of three numbers"},
        {start + "intensity = [1, 1, 1]\nradiance = [1, 1, 1]\nradius_m = 1\n",
         "line 4: 'radiance' and 'intensity': must be one of the two"},
        {start + "radiance = [1, 1, 1]\n", "line 3: 'radiance' without 'radius_m': must be given, 0.001 to 100 m"},
        {start + "radiance = [1, 1, 1]\nradius_m = 0\n", "line 4: 'radius_m' = 0: must be a number, 0.001 to 100 m"},
        {start + "radiance = [1, 1, 1]\nradius_m = true\n", "line 4: 'radius_m' = true: must be a number"},
        {"[[light]]\nposition = [0, inf, 0]\n",
         "line 2: 'position' = [0, inf, 0]: must be a list of three numbers, each -1000000 to 1000000 m"},
        {"[[light]]\nname = 3\n", "line 2: 'name' = 3: must be a text"},
        {start + "intensty = [1, 1, 1]\n", "line 3: no key is called 'intensty'; did you mean 'intensity'?"},
        {start + "watts = 40\n",
         "line 3: no key is called 'watts'; must be one of name, position, intensity, radiance, radius_m"},
        {"[[lights]]\nposition = [0, 0, 0]\n", "line 1: no key is called 'lights'; did you mean 'light'?"},
        {"[light]\nposition = [0, 0, 0]\n", "must be tables: write [[light]] over each"},
        {"light = 3\n", "line 1: 'light' = 3: must be tables: write [[light]] over each"},
        {"[[light]]\nposition = [0, 0\n", "line"},
    };
    for (const auto& wrong : cases) {
        const std::string path = folder.write("lamps.toml", wrong.text);
        const std::string sentence = sentenceOf(ErrorCode::Input, [&] { readLights(path); });
        EXPECT_SAYS(sentence, "lights '" + path + "'");
        EXPECT_SAYS(sentence, wrong.sentence);
    }
}

TEST(LightsFile, SaysThatThereIsNone)
{
    const TemporaryFolder folder;
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readLights(folder / "nowhere.toml"); }),
                "nowhere.toml': no such file");
    EXPECT_SAYS(sentenceOf(ErrorCode::Input, [&] { readLights(folder.path()); }), "': no such file");
}

// The sample street: eight lamps lit, over the road, alike.
TEST(LightsFile, ReadsTheSampleStreet)
{
    const auto lights = readLights(VIRGA_TEST_DATA "/../../samples/street_lamps.toml");
    ASSERT_EQ(lights.size(), 8u);
    for (const SceneLight& lamp : lights) {
        EXPECT_EQ(std::abs(lamp.position.x), 3.25);
        EXPECT_NEAR(lamp.intensity.r, 0.76, 0.01);
    }
}

}  // namespace
}  // namespace virga::shot
