#include <OpenColorIO/OpenColorIO.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "io/ColorConversion.h"
#include "io/Helpers.h"

namespace virga::io {
namespace {

namespace OCIO = OCIO_NAMESPACE;

std::array<float, 3> convert(const char* from, const char* to, std::array<float, 3> rgb)
{
    makeColorTransform(from, to)->apply(&rgb[0], &rgb[1], &rgb[2], 1);
    return rgb;
}

// The fast way for curves against OpenColorIO's own exponent with a linear toe.
TEST(Color, CurvesAgreeWithOpenColorIo)
{
    const struct {
        const char* space;
        double gamma, offset;
    } cases[] = {{"sRGB", 2.4, 0.055}, {"Rec.709 camera", 1 / 0.45, 0.09929682680944}};
    for (const auto& c : cases) {
        const auto transform = OCIO::ExponentWithLinearTransform::Create();
        transform->setGamma({c.gamma, c.gamma, c.gamma, 1.0});
        transform->setOffset({c.offset, c.offset, c.offset, 0.0});
        transform->setNegativeStyle(OCIO::NEGATIVE_MIRROR);
        const auto config = OCIO::Config::CreateRaw();
        const auto cpu = config->getProcessor(transform)->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS);
        for (int i = -64; i <= 512; ++i) {
            float theirs[3] = {float(i) / 256, float(i) / 300, float(i) / 400};
            const auto ours = convert(c.space, "Linear Rec.709", {theirs[0], theirs[1], theirs[2]});
            cpu->applyRGB(theirs);
            for (std::size_t k = 0; k < 3; ++k)
                ASSERT_NEAR(ours[k], theirs[k], 2e-6 * std::max(1.0f, std::fabs(theirs[k])));
        }
    }
}

// Matrices from ITU-R BT.2087 (709 to 2020) and AMPAS TB-2014-004 (AP1 to AP0).
TEST(Color, PrimariesFollowPublishedMatrices)
{
    const double to2020[3][3] = {{0.6274, 0.3293, 0.0433}, {0.0691, 0.9195, 0.0114}, {0.0164, 0.0880, 0.8956}};
    const double toAp0[3][3] = {{0.6954522414, 0.1406786965, 0.1638690622},
                                {0.0447945634, 0.8596711185, 0.0955343182},
                                {-0.0055258826, 0.0040252103, 1.0015006723}};
    for (std::size_t k = 0; k < 3; ++k) {
        std::array<float, 3> unit{};
        unit[k] = 1;
        const auto wide = convert("Linear Rec.709", "Linear Rec.2020", unit);
        const auto aces = convert("ACEScg", "ACES2065-1", unit);
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_NEAR(wide[i], to2020[i][k], 5e-5);
            EXPECT_NEAR(aces[i], toAp0[i][k], 1e-6);
        }
    }
}

TEST(Color, EverySpaceComesBackThroughEveryOther)
{
    for (const NamedSpace& from : ownColorspaces()) {
        if (from.primaries == nullptr) continue;
        for (const char* to : {"Linear Rec.709", "ACEScg", "Rec.2020 PQ", "sRGB", "ACEScct"}) {
            const std::array<float, 3> color = {0.2f, 0.5f, 0.7f};
            const auto there = convert(from.name, to, color);
            const auto back = convert(to, from.name, there);
            for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back[i], color[i], 2e-4) << from.name << " through " << to;
        }
    }
}

TEST(Color, WhiteStaysWhiteAndNegativeValuesSurvive)
{
    for (const char* space : {"ACEScg", "Linear Rec.2020", "Linear P3-D65", "ACES2065-1", "Linear Rec.601 525"}) {
        for (const float value : convert("Linear Rec.709", space, {1, 1, 1})) EXPECT_NEAR(value, 1, 1e-5) << space;
        const auto back = convert(space, "Linear Rec.709", convert("Linear Rec.709", space, {-0.2f, 3.0f, 1e-3f}));
        EXPECT_NEAR(back[0], -0.2f, 1e-5);
        EXPECT_NEAR(back[1], 3.0f, 1e-5);
        EXPECT_NEAR(back[2], 1e-3f, 1e-5);
    }
}

TEST(Color, WorkingSpaceIsLinearInThePlatesPrimaries)
{
    EXPECT_EQ(workingColorspace("sRGB"), "Linear Rec.709");
    EXPECT_EQ(workingColorspace("rec.2020 pq"), "Linear Rec.2020");
    EXPECT_EQ(workingColorspace("ACEScct"), "ACEScg");
    EXPECT_EQ(workingColorspace("raw"), "raw");
    EXPECT_TRUE(makeColorTransform("raw", "raw")->isIdentity());
    EXPECT_TRUE(makeColorTransform("raw", "sRGB")->isIdentity());
    EXPECT_TRUE(makeColorTransform("ACEScg", "ACEScg")->isIdentity());
}

TEST(Color, AnUnknownSpaceIsNamedWithThoseNearIt)
{
    const auto sentence = [](const char* name) {
        return test::sentenceOf(ErrorCode::InvalidArgument, [&] { resolveColorspace(name); });
    };
    EXPECT_SAYS(sentence("sRBG"), "'sRBG' is not known; near it are sRGB, ");
    EXPECT_SAYS(sentence("rec2020 pq"), "near it are Rec.2020 PQ, ");
    EXPECT_SAYS(sentence("rec.7009"), "near it are Rec.709 camera, Rec.709 BT.1886, ");
    EXPECT_SAYS(sentence("aces"), "near it are ACEScg, ACES2065-1, ACEScct, ACEScc;");
    EXPECT_SAYS(sentence("no such thing"), "'list' names all");
    EXPECT_LT(sentence("no such thing").size(), 200u);
    for (const NamedSpace& space : ownColorspaces()) EXPECT_SAYS(sentence("list"), space.name);
}

}  // namespace
}  // namespace virga::io
