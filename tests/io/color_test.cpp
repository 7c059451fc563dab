#include <OpenColorIO/OpenColorIO.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <set>

#include "core/Words.h"
#include "io/ColorConversion.h"
#include "io/Helpers.h"
#include "io/ImageColor.h"

namespace virga::io {
namespace {

namespace OCIO = OCIO_NAMESPACE;

std::array<float, 3> convert(const std::string& from, const std::string& to, std::array<float, 3> rgb,
                             const ColorConfig& config = *ColorConfig::builtIn())
{
    config.transform(from, to)->apply(&rgb[0], &rgb[1], &rgb[2], 1);
    return rgb;
}

double worstOf(const std::array<float, 3>& a, const std::array<float, 3>& b)
{
    double worst = 0;
    for (std::size_t i = 0; i < 3; ++i)
        worst = std::max(worst, std::fabs(double(a[i]) - double(b[i])) / std::max(1.0, std::fabs(double(b[i]))));
    return worst;
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

// Whole spaces, curve, primaries and adaptation at once, against those that OpenColorIO itself has built in: another
// team's reading of the same documents. Its ACEScc is a table and holds no negative light, its LogC3 has the constants
// with more digits than ARRI prints.
TEST(Color, SpacesAgreeWithOpenColorIosBuiltInOnes)
{
    const struct {
        const char* space;
        const char* style;
        double tolerance;
        bool clips = false;  ///< theirs holds no negative light
    } cases[] = {{"ACEScct", "ACEScct_to_ACES2065-1", 2e-6},
                 {"ACEScc", "ACEScc_to_ACES2065-1", 1e-5, true},
                 {"ACEScg", "ACEScg_to_ACES2065-1", 1e-6},
                 {"ARRI LogC3 (EI800)", "ARRI_ALEXA-LOGC-EI800-AWG_to_ACES2065-1", 2e-5},
                 {"CanonLog2 CinemaGamut", "CANON_CLOG2-CGAMUT_to_ACES2065-1", 2e-6},
                 {"CanonLog3 CinemaGamut", "CANON_CLOG3-CGAMUT_to_ACES2065-1", 2e-6},
                 {"V-Log V-Gamut", "PANASONIC_VLOG-VGAMUT_to_ACES2065-1", 2e-6},
                 {"Log3G10 REDWideGamutRGB", "RED_LOG3G10-RWG_to_ACES2065-1", 2e-6},
                 {"S-Log3 S-Gamut3", "SONY_SLOG3-SGAMUT3_to_ACES2065-1", 2e-6},
                 {"S-Log3 S-Gamut3.Cine", "SONY_SLOG3-SGAMUT3.CINE_to_ACES2065-1", 2e-6}};
    for (const auto& c : cases) {
        const auto transform = OCIO::BuiltinTransform::Create();
        transform->setStyle(c.style);
        const auto config = OCIO::Config::CreateRaw();
        const auto cpu = config->getProcessor(transform)->getOptimizedCPUProcessor(OCIO::OPTIMIZATION_LOSSLESS);
        for (int i = 0; i <= 64; ++i) {
            std::array<float, 3> theirs = {float(i) / 64, float(64 - i) / 100, 0.4f};
            auto ours = convert(c.space, "ACES2065-1", theirs);
            cpu->applyRGB(theirs.data());
            if (c.clips)
                for (float& value : ours) value = std::max(value, 0.0f);
            ASSERT_LT(worstOf(ours, theirs), c.tolerance) << c.space << " " << i;
        }
    }
}

// Matrices as their documents print them, row by row.
TEST(Color, PrimariesFollowPublishedMatrices)
{
    const struct {
        const char *from, *to;
        double matrix[3][3];
        double tolerance;  // half the last digit that is printed
    } cases[] = {
        // ITU-R BT.2087-0, 4
        {"Linear Rec.709",
         "Linear Rec.2020",
         {{0.6274, 0.3293, 0.0433}, {0.0691, 0.9195, 0.0114}, {0.0164, 0.0880, 0.8956}},
         6e-5},
        // AMPAS TB-2014-004, annex
        {"ACEScg",
         "ACES2065-1",
         {{0.6954522414, 0.1406786965, 0.1638690622},
          {0.0447945634, 0.8596711185, 0.0955343182},
          {-0.0055258826, 0.0040252103, 1.0015006723}},
         1e-6},
        // SMPTE RP 177 for BT.709, as in SMPTE ST 274
        {"Linear Rec.709",
         "CIE-XYZ-D65",
         {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}},
         6e-5},
        // SMPTE EG 432-1
        {"Linear P3-D65",
         "CIE-XYZ-D65",
         {{0.4865709, 0.2656677, 0.1982173}, {0.2289746, 0.6917385, 0.0792869}, {0, 0.0451134, 1.0439444}},
         1e-6},
        // Adobe RGB (1998), 4.3.5.3
        {"Linear Adobe RGB",
         "CIE-XYZ-D65",
         {{0.57667, 0.18556, 0.18823}, {0.29734, 0.62736, 0.07529}, {0.02703, 0.07069, 0.99134}},
         6e-6},
        // ARRI, ALEXA Log C Curve, 2017: no adaptation, both whites are D65
        {"Linear ARRI Wide Gamut 3",
         "Linear Rec.709",
         {{1.617523, -0.537287, -0.080237}, {-0.070573, 1.334613, -0.264040}, {-0.021102, -0.226954, 1.248056}},
         1e-6},
        // ARRI LogC4 specification, 2022: to XYZ D65
        {"Linear ARRI Wide Gamut 4",
         "CIE-XYZ-D65",
         {{0.704858320407232, 0.129760295170463, 0.115837311473977},
          {0.254524176404027, 0.781477732712002, -0.036001909116029},
          {0, 0, 1.089057750759878}},
         1e-6},
        // ACES input transforms of Academy and Sony (CAT02), Blackmagic (CAT02), Panasonic (Bradford)
        {"Linear S-Gamut3",
         "ACES2065-1",
         {{0.7529825954, 0.1433702162, 0.1036471884},
          {0.0217076974, 1.0153188355, -0.0370265329},
          {-0.0094160528, 0.0033704179, 1.0060456349}},
         1e-6},
        {"Linear S-Gamut3.Cine",
         "ACES2065-1",
         {{0.6387886672, 0.2723514337, 0.0888598991},
          {-0.0039159060, 1.0880732309, -0.0841573249},
          {-0.0299072021, -0.0264325799, 1.0563397820}},
         1e-6},
        {"Linear BMD WideGamut Gen5",
         "ACES2065-1",
         {{0.647091325580708, 0.242595385134207, 0.110313289285085},
          {0.065191599732852, 1.025047567604761, -0.090239167337613},
          {-0.027557072919470, -0.080588709717778, 1.108145782637248}},
         1e-6},
        {"Linear DaVinci WideGamut",
         "ACES2065-1",
         {{0.748270290272981, 0.167694659554328, 0.084035050172691},
          {0.020842123468910, 1.111904742688940, -0.132746866157851},
          {-0.091512257422573, -0.127746712807307, 1.219258970229880}},
         1e-6},
        {"Linear V-Gamut",
         "ACES2065-1",
         {{0.72461670, 0.16691529, 0.10846801},
          {0.02139025, 0.98490816, -0.00629840},
          {-0.00923556, -0.00105691, 1.01029247}},
         1e-6},
        {"Linear REDWideGamutRGB",
         "ACES2065-1",
         {{0.785059, 0.083859, 0.131082}, {0.023174, 1.087898, -0.111071}, {-0.073760, -0.314590, 1.388350}},
         1e-6},
    };
    for (const auto& c : cases)
        for (std::size_t k = 0; k < 3; ++k) {
            std::array<float, 3> unit{};
            unit[k] = 1;
            const auto column = convert(c.from, c.to, unit);
            const auto back = convert(c.to, c.from, column);
            for (std::size_t i = 0; i < 3; ++i) {
                EXPECT_NEAR(column[i], c.matrix[i][k], c.tolerance) << c.from << " to " << c.to << " " << i << k;
                EXPECT_NEAR(back[i], unit[i], 2e-6) << c.to << " to " << c.from;
            }
        }
}

TEST(Color, EverySpaceComesBackThroughEveryOther)
{
    for (const NamedSpace& from : ownColorspaces()) {
        if (from.primaries == nullptr) continue;
        for (const NamedSpace& to : ownColorspaces()) {
            if (to.primaries == nullptr) continue;
            const std::array<float, 3> color = {0.2f, 0.5f, 0.6f};
            const auto there = convert(from.name, to.name, color);
            EXPECT_LT(worstOf(convert(to.name, from.name, there), color), 2e-4) << from.name << " through " << to.name;
        }
    }
}

TEST(Color, WhiteStaysWhiteAndNegativeAndBrightValuesSurvive)
{
    for (const NamedSpace& space : ownColorspaces()) {
        if (space.primaries == nullptr) continue;
        SCOPED_TRACE(space.name);
        if (space.curve == Curve::Linear && !space.primaries->isXyz) {
            for (const float value : convert("Linear Rec.709", space.name, {1, 1, 1})) EXPECT_NEAR(value, 1, 1e-5);
        }
        for (const std::array<float, 3>& light : {std::array{-0.2f, 3.0f, 1e-3f}, {40.0f, -0.01f, 0.0f}}) {
            const auto back = convert(space.name, "Linear Rec.709", convert("Linear Rec.709", space.name, light));
            for (std::size_t i = 0; i < 3; ++i)
                EXPECT_NEAR(back[i], light[i], 1e-5 * (1 + double(light[1] + light[0])));
        }
    }
}

TEST(Color, WorkingSpaceIsLinearInThePlatesPrimaries)
{
    const auto config = ColorConfig::builtIn();
    EXPECT_EQ(config->working("sRGB"), "Linear Rec.709");
    EXPECT_EQ(config->working("rec.2020 pq"), "Linear Rec.2020");
    EXPECT_EQ(config->working("ACEScct"), "ACEScg");
    EXPECT_EQ(config->working("logc4"), "Linear ARRI Wide Gamut 4");
    EXPECT_EQ(config->working("raw"), "raw");
    EXPECT_TRUE(config->transform("raw", "raw")->isIdentity());
    EXPECT_TRUE(config->transform("raw", "sRGB")->isIdentity());
    EXPECT_TRUE(config->transform("ACEScg", "lin_ap1")->isIdentity());
    for (const NamedSpace& space : ownColorspaces()) {
        const NamedSpace* working = findOwnColorspace(config->working(space.name));
        ASSERT_NE(working, nullptr) << space.name;
        EXPECT_EQ(working->curve, Curve::Linear);
        EXPECT_EQ(working->primaries, space.primaries);
    }
}

// Whatever their case; no alias means two things.
TEST(Color, NamesAliasesAndRolesAreFound)
{
    const auto config = ColorConfig::builtIn();
    std::set<std::string> seen;
    for (const NamedSpace& space : ownColorspaces()) {
        std::vector<std::string> names = space.aliases;
        names.push_back(space.name);
        for (const std::string& name : names) {
            EXPECT_TRUE(seen.insert(lowerCase(name)).second) << name << " stands for two spaces";
            std::string loud = name;
            std::transform(loud.begin(), loud.end(), loud.begin(), [](unsigned char c) { return std::toupper(c); });
            EXPECT_EQ(config->resolve(loud), space.name);
        }
    }
    const std::pair<const char*, const char*> typed[] = {
        {"srgb", "sRGB"},
        {"rec709", "sRGB"},
        {"Utility - sRGB - Texture", "sRGB"},
        {"acescg", "ACEScg"},
        {"rec1886", "Rec.709 BT.1886"},
        {"p3-d65", "P3-D65 gamma 2.6"},
        {"rec.2100-pq", "Rec.2020 PQ"},
        {"hlg", "Rec.2020 HLG"},
        {"slog3", "S-Log3 S-Gamut3"},
        {"logc", "ARRI LogC3 (EI800)"},
        {"scene_linear", "ACEScg"},
        {"COMPOSITING_LINEAR", "ACEScg"},
        {"color_timing", "ACEScct"},
        {"texture_paint", "ACEScct"},
        {"matte_paint", "sRGB"},
        {"color_picking", "sRGB"},
        {"aces_interchange", "ACES2065-1"},
        {"reference", "ACES2065-1"},
        {"cie_xyz_d65_interchange", "CIE-XYZ-D65"},
        {"data", "raw"},
        {"default", "raw"},
    };
    for (const auto& [name, space] : typed) EXPECT_EQ(config->resolve(name), space) << name;
    for (const auto& [role, space] : config->roles()) EXPECT_EQ(config->resolve(role), space) << role;
}

TEST(Color, AnUnknownSpaceIsNamedWithThoseNearIt)
{
    const auto sentence = [](const char* name) {
        return test::sentenceOf(ErrorCode::InvalidArgument, [&] { ColorConfig::builtIn()->resolve(name); });
    };
    EXPECT_SAYS(sentence("sRBG"), "'sRBG' is not known; near it are sRGB, ");
    EXPECT_SAYS(sentence("rec2020 pq"), "near it are Rec.2020 PQ, ");
    EXPECT_SAYS(sentence("aces"), "near it are ACES2065-1, ACEScg, ACEScct, ACEScc;");
    EXPECT_SAYS(sentence("no such thing"), "'virga info --colorspaces' lists all");
    EXPECT_LT(sentence("no such thing").size(), 220u);
}

TEST(Color, InteropIdsNameOneSpaceEachAndAreFound)
{
    std::set<std::string> seen;
    for (const NamedSpace& space : ownColorspaces()) {
        const std::string id = interopIdOf(space);
        EXPECT_TRUE(seen.insert(id).second) << id;
        EXPECT_EQ(colorClaims({.isFloat = true, .interopId = id}).front().colorspace == space.name ||
                      findOwnColorspace(colorClaims({.isFloat = true, .interopId = id}).front().colorspace) == &space,
                  true)
            << id;
    }
    EXPECT_EQ(interopIdOf(*findOwnColorspace("ACEScg")), "lin_ap1_scene");
    EXPECT_EQ(interopIdOf(*findOwnColorspace("ARRI LogC3 (EI800)")), "virga:arri_logc3_ei800");
}

// A header may say several things; what weighs more wins, and what nobody knows is passed over.
TEST(Color, ClaimsOfAFileAreWeighed)
{
    const auto config = ColorConfig::builtIn();
    const auto chosen = [&](const ImageColorWords& words, const std::string& flag = {}) {
        const ColorClaim claim = chooseColorspace(*config, flag, "picture", colorClaims(words));
        return claim.colorspace + ", " + claim.source + (claim.doubt.empty() ? "" : "; " + claim.doubt);
    };
    const std::array<float, 8> ap1 = {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f};
    const std::array<float, 8> strange = {0.6f, 0.3f, 0.2f, 0.7f, 0.1f, 0.1f, 0.3f, 0.3f};
    EXPECT_EQ(chosen({}), "sRGB, guess: integer pixels of a picture");
    EXPECT_EQ(chosen({.isFloat = true}), "Linear Rec.709, guess: floating point is linear light");
    EXPECT_EQ(chosen({.isFloat = true, .chromaticities = ap1}), "ACEScg, metadata: chromaticities");
    EXPECT_EQ(
        chosen({.isFloat = true, .chromaticities = strange}),
        "Linear Rec.709, guess: floating point is linear light; its chromaticities are of no space that is known");
    EXPECT_EQ(chosen({.isFloat = true, .interopId = "lin_p3d65_scene", .chromaticities = ap1}),
              "Linear P3-D65, metadata: colorInteropID lin_p3d65_scene");
    EXPECT_EQ(chosen({.isFloat = true, .interopId = "studio:secret", .chromaticities = ap1}),
              "ACEScg, metadata: chromaticities");
    EXPECT_EQ(chosen({.isFloat = true, .interopId = "unknown", .isAcesContainer = true}),
              "ACES2065-1, metadata: ACES container");
    EXPECT_EQ(chosen({.profile = "Display P3", .hasProfile = true, .transfer = "sRGB"}),
              "Display P3, metadata: ICC profile 'Display P3'");
    EXPECT_EQ(chosen({.profile = "Scanner 3", .hasProfile = true}),
              "sRGB, guess: integer pixels of a picture; its ICC profile 'Scanner 3' is not known");
    EXPECT_EQ(chosen({.transfer = "KodakLog"}), "Cineon, metadata: KodakLog");
    EXPECT_EQ(chosen({.transfer = "Gamma2.2"}), "sRGB, metadata: Gamma2.2");
    EXPECT_EQ(chosen({.transfer = "Gamma1.8"}),
              "sRGB, guess: integer pixels of a picture; its transfer 'Gamma1.8' is not known");
    EXPECT_EQ(chosen({.cicp = ColorClaim{"Rec.2020 PQ", "metadata: pq"}, .profile = "Display P3", .hasProfile = true}),
              "Rec.2020 PQ, metadata: pq");
    EXPECT_EQ(chosen({.transfer = "Linear"}), "Linear Rec.709, metadata: Linear");
    EXPECT_EQ(chosen({.transfer = "KodakLog"}, "logc4"), "ARRI LogC4, flag");
}

/// A configuration like a small studio's: a linear space of its own primaries' name, a curve, data, roles and a rule.
std::string studioConfig(const std::string& roles)
{
    return "ocio_profile_version: 2\n"
           "strictparsing: true\n"
           "roles: {" +
           roles +
           "}\n"
           "file_rules:\n"
           "  - !<Rule> {name: Logs, extension: \"*\", pattern: \"*_log*\", colorspace: show_log}\n"
           "  - !<Rule> {name: Default, colorspace: show_lin}\n"
           "displays:\n"
           "  none:\n"
           "    - !<View> {name: Raw, colorspace: show_data}\n"
           "colorspaces:\n"
           "  - !<ColorSpace> {name: show_aces}\n"
           "  - !<ColorSpace> {name: show_lin, aliases: [plate_lin], to_scene_reference: "
           "!<BuiltinTransform> {style: ACEScg_to_ACES2065-1}}\n"
           "  - !<ColorSpace> {name: show_log, to_scene_reference: !<BuiltinTransform> {style: "
           "ACEScct_to_ACES2065-1}}\n"
           "  - !<ColorSpace> {name: show_odd, to_scene_reference: "
           "!<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.7, 0, 0, 0, 0, 0.9, 0, 0, 0, 0, 1]}}\n"
           "  - !<ColorSpace> {name: show_data, isdata: true}\n";
}

const char* const allRoles = "default: show_data, scene_linear: show_lin, aces_interchange: show_aces";

class UsersConfig : public testing::Test {
protected:
    std::string write(const std::string& text)
    {
        const std::string path = folder_ / "show.ocio";
        std::ofstream(path) << text;
        return path;
    }

    test::TemporaryFolder folder_;
};

TEST_F(UsersConfig, ItsNamesComeBeforeOurs)
{
    const auto config = ColorConfig::open(write(studioConfig(allRoles)));
    EXPECT_SAYS(config->origin(), "show.ocio (--ocio)");
    EXPECT_EQ(config->resolve("PLATE_LIN"), "show_lin");
    EXPECT_EQ(config->resolve("scene_linear"), "show_lin");
    EXPECT_EQ(config->resolve("acescct"), "ACEScct");  // ours is still there
    EXPECT_EQ(config->working("show_log"), "show_lin");
    EXPECT_EQ(config->working("show_data"), "show_data");
    EXPECT_EQ(config->working("sRGB"), "Linear Rec.709");
    EXPECT_EQ(config->fromFileRules("a_log.0001.dpx"), "show_log");
    EXPECT_EQ(config->fromFileRules("a.0001.dpx"), "");
    EXPECT_EQ(config->spaces().front().name, "show_aces");
    EXPECT_TRUE(config->spaces().front().isUsers);
}

TEST_F(UsersConfig, JoinsOursThroughAces)
{
    const auto config = ColorConfig::open(write(studioConfig(allRoles)));
    const std::array<float, 3> color = {0.2f, 0.5f, 0.7f};
    EXPECT_LT(worstOf(convert("show_log", "sRGB", color, *config), convert("ACEScct", "sRGB", color)), 2e-6);
    EXPECT_LT(worstOf(convert("sRGB", "show_log", color, *config), convert("sRGB", "ACEScct", color)), 2e-6);
    EXPECT_LT(worstOf(convert("show_log", "show_lin", color, *config), convert("ACEScct", "ACEScg", color)), 2e-6);
    ASSERT_NE(config->equivalent("show_lin"), nullptr);
    EXPECT_EQ(config->equivalent("show_lin")->name, "ACEScg");
    EXPECT_EQ(config->equivalent("show_log")->name, "ACEScct");
    EXPECT_EQ(config->equivalent("show_data")->name, "raw");
    EXPECT_EQ(config->equivalent("show_odd"), nullptr);
}

TEST_F(UsersConfig, RulesComeAfterWhatTheFileSaysAndBeforeGuesses)
{
    const auto config = ColorConfig::open(write(studioConfig(allRoles)));
    const auto chosen = [&](const char* flag, const char* path, const ColorClaim& said) {
        const ColorClaim claim = chooseColorspace(*config, flag, path, {said, {"sRGB", "guess: nothing said"}});
        return claim.colorspace + ", " + claim.source.substr(0, 10);
    };
    const ColorClaim said{"Cineon", "metadata: KodakLog"}, unknown{"nobody's", "metadata: nobody's"};
    EXPECT_EQ(chosen("logc4", "a_log.dpx", said), "ARRI LogC4, flag");
    EXPECT_EQ(chosen("", "a_log.dpx", said), "Cineon, metadata: ");
    EXPECT_EQ(chosen("", "a_log.dpx", unknown), "show_log, file rules");
    EXPECT_EQ(chosen("", "a.dpx", unknown), "sRGB, guess: not");
}

TEST_F(UsersConfig, FaultsAreOneSentenceEach)
{
    const auto opened = [](const std::string& path) {
        return test::sentenceOf(ErrorCode::Input, [&] { ColorConfig::open(path); });
    };
    EXPECT_SAYS(opened(folder_ / "none.ocio"), "none.ocio (--ocio): does not exist");
    EXPECT_SAYS(opened(folder_.path().string()), "is not a file");
    EXPECT_SAYS(opened(write("just words")), "show.ocio (--ocio): is no colour configuration that can be used");
    EXPECT_SAYS(opened(write("")), "is no colour configuration that can be used");
    EXPECT_SAYS(opened(write("ocio_profile_version: 9\n")), "is no colour configuration that can be used");
    EXPECT_SAYS(opened(write(studioConfig("scene_linear: gone"))), "gone");
    EXPECT_EQ(opened(write(studioConfig("scene_linear: gone"))).find('\n'), std::string::npos);

    const auto noLinear = ColorConfig::open(write(studioConfig("default: show_data, aces_interchange: show_aces")));
    EXPECT_SAYS(test::sentenceOf(ErrorCode::Input, [&] { noLinear->working("show_log"); }),
                "has no role scene_linear, so that 'show_log' has no linear space to work in");
    const auto noAces = ColorConfig::open(write(studioConfig("default: show_data, scene_linear: show_lin")));
    EXPECT_SAYS(test::sentenceOf(ErrorCode::InvalidArgument, [&] { noAces->transform("show_log", "sRGB"); }),
                "no way from colour space 'show_log' to 'sRGB'");
    EXPECT_SAYS(test::sentenceOf(ErrorCode::InvalidArgument, [&] { noAces->transform("show_log", "sRGB"); }),
                "no role aces_interchange");
    EXPECT_EQ(noAces->equivalent("show_lin"), nullptr);
}

}  // namespace
}  // namespace virga::io
