#include "shot/Doubts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "camera/TrackFile.h"
#include "shot/Preflight.h"
#include "support/Files.h"

namespace virga::shot {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The finding with these words in it; a failed test if there is none.
Finding with(const std::vector<Finding>& findings, const std::string& words)
{
    for (const Finding& finding : findings)
        if (finding.sentence.find(words) != std::string::npos) return finding;
    std::string all;
    for (const Finding& finding : findings) all += finding.sentence + "\n";
    ADD_FAILURE() << "nobody says '" << words << "' in:\n" << all;
    return {};
}

bool warns(const std::vector<Finding>& findings)
{
    return std::any_of(findings.begin(), findings.end(),
                       [](const Finding& finding) { return finding.severity >= Severity::Warning; });
}

camera::Pose at(double x, const glm::dmat3& turn = glm::dmat3(1.0)) { return {{x, 0, 0}, turn, std::nullopt}; }

std::vector<FrameNumber> range(FrameNumber first, FrameNumber last)
{
    std::vector<FrameNumber> frames;
    for (FrameNumber frame = first; frame <= last; ++frame) frames.push_back(frame);
    return frames;
}

std::vector<Finding> trackDoubts(const camera::Track& track, const std::vector<FrameNumber>& frames)
{
    return shot::trackDoubts(track, frames, 25, {});
}

io::PlateInfo goodPlate()
{
    io::PlateInfo plate;
    plate.isMovie = true;
    plate.width = 1920;
    plate.height = 1080;
    plate.fps = 25;
    plate.colorspace = "sRGB";
    plate.colorspaceSource = "metadata: bt709";
    plate.scan = io::Scan::Progressive;
    return plate;
}

TEST(PlateDoubts, AGoodPlateHasNone)
{
    for (const Finding& finding : plateDoubts(goodPlate(), true)) EXPECT_EQ(finding.severity, Severity::Ok);
}

TEST(PlateDoubts, EachIsSaidWithItsFlag)
{
    io::PlateInfo plate = goodPlate();
    plate.colorspaceSource = "guess: video that does not say";
    EXPECT_EQ(with(plateDoubts(plate, true), "guess").flag, "--colorspace");
    plate = goodPlate();
    plate.pixelAspect = 2;
    EXPECT_EQ(with(plateDoubts(plate, true), "2 times as wide").severity, Severity::Warning);
    plate = goodPlate();
    plate.scan = io::Scan::TopFirst;
    EXPECT_EQ(with(plateDoubts(plate, true), "interlaced").flag, "--deinterlace");
    plate.isDeinterlaced = true;
    EXPECT_FALSE(warns(plateDoubts(plate, true)));
    plate = goodPlate();
    EXPECT_EQ(with(plateDoubts(plate, false), "does not say its frame rate").flag, "--fps");
    plate.fps = 90000;
    EXPECT_EQ(with(plateDoubts(plate, true), "90000").severity, Severity::Warning);
    plate = goodPlate();
    plate.isMovie = false;
    plate.bitDepth = 10;
    plate.colorspace = "Linear Rec.709";
    EXPECT_EQ(with(plateDoubts(plate, true), "10 bits").severity, Severity::Warning);
    plate.isFloat = true;
    plate.bitDepth = 16;
    EXPECT_FALSE(warns(plateDoubts(plate, true)));
}

TEST(TrackDoubts, ATrackThatFitsHasNone)
{
    std::map<FrameNumber, camera::Pose> poses;
    for (FrameNumber frame = 1001; frame <= 1100; ++frame) poses[frame] = at(0.5 * double(frame));  // 12.5 m/s
    EXPECT_TRUE(trackDoubts(camera::Track(poses), range(1001, 1100)).empty());
    EXPECT_TRUE(trackDoubts(camera::Track({{5, at(0)}}), range(1001, 1100)).empty());  // stands anyway
    EXPECT_TRUE(trackDoubts(camera::Track(), range(1, 3)).empty());
}

TEST(TrackDoubts, FramesWithoutPoses)
{
    const camera::Track track({{1, at(0)}, {50, at(1)}});
    const Finding apart = with(trackDoubts(track, range(1001, 1050)), "1-50");
    EXPECT_EQ(apart.flag, "--camera-offset 1000");
    EXPECT_EQ(apart.severity, Severity::Warning);
    EXPECT_EQ(with(trackDoubts(track, range(41, 60)), "51-60").severity, Severity::Warning);
    EXPECT_TRUE(trackDoubts(track, range(2, 50)).empty());
}

TEST(TrackDoubts, JumpsNameTheFrameAndTheSpeed)
{
    const Finding jump =
        with(trackDoubts(camera::Track({{1, at(0)}, {2, at(0.1)}, {3, at(1000)}}), range(1, 3)), "999.9 m");
    EXPECT_NE(jump.sentence.find("after frame 2"), std::string::npos) << jump.sentence;
    EXPECT_EQ(jump.flag, "--camera-scale 0.01");
    // As far, but over as many frames as it takes.
    EXPECT_TRUE(trackDoubts(camera::Track({{1, at(0)}, {1001, at(1000)}}), range(1, 3)).empty());
}

TEST(TrackDoubts, WhichWayIsUp)
{
    const auto tilted = [](double degrees) {
        return camera::Track({{1, at(0, camera::rotation(camera::RotationOrder::ZXY, glm::radians(degrees), 0, 0))}});
    };
    for (const double pitch : {-50.0, -10.0, 0.0, 30.0}) EXPECT_TRUE(trackDoubts(tilted(pitch), {1}).empty()) << pitch;
    EXPECT_EQ(with(trackDoubts(tilted(90), {1}), "perhaps z").flag, "--camera-up z");
    EXPECT_EQ(with(trackDoubts(tilted(-90), {1}), "perhaps z").flag, "--camera-up=-z");
    EXPECT_EQ(with(trackDoubts(tilted(180), {1}), "upside down").flag, "--camera-up=-y");
    const glm::dmat3 rolled = camera::rotation(camera::RotationOrder::ZXY, 0, 0, glm::radians(90.0));
    EXPECT_EQ(with(trackDoubts(camera::Track({{1, at(0, rolled)}}), {1}), "on its side").severity, Severity::Warning);
}

TEST(TrackDoubts, UnderTheGroundIsAnError)
{
    camera::Pose low = at(0);
    low.position.y = -2;
    Settings settings;
    settings.ground = "1.5";
    const camera::Track track({{1, at(0)}, {2, low}});
    const Finding under = with(shot::trackDoubts(track, {1, 2}, 25, settings), "frame 2");
    EXPECT_EQ(under.severity, Severity::Error);
    EXPECT_NE(under.sentence.find("0.5 m"), std::string::npos) << under.sentence;
    EXPECT_TRUE(shot::trackDoubts(track, {1}, 25, settings).empty());  // a frame that nobody renders
}

/// A street: rows from far to near, `nearest` to `farthest` of the file's units, rounded if they are codes.
ImageF streetDepth(double nearest, double farthest, bool areWhole = false)
{
    ImageF stored(8, 40, 1);
    for (int y = 0; y < stored.height(); ++y)
        for (int x = 0; x < stored.width(); ++x) {
            const double value =
                farthest + (nearest - farthest) * y / (stored.height() - 1) + (areWhole ? 0 : 0.01 * x);
            stored.at(x, y) = float(areWhole ? std::round(value) : value);
        }
    return stored;
}

std::vector<Finding> doubtsOf(const ImageF& stored, double full = 1, const Settings& settings = {},
                              const depth::DepthOptions& options = {})
{
    return depthDoubts({stored, full, depth::sanitizeDepth(stored, options)}, settings);
}

TEST(DepthDoubts, MetresHaveNone)
{
    EXPECT_TRUE(doubtsOf(streetDepth(2, 80)).empty());
    EXPECT_TRUE(doubtsOf(streetDepth(0.4, 300)).empty());
    ImageF sky = streetDepth(2, 80);
    for (int x = 0; x < sky.width(); ++x) sky.at(x, 0) = kInfinity;
    EXPECT_TRUE(doubtsOf(sky).empty());
}

TEST(DepthDoubts, UnitsThatLookWrong)
{
    EXPECT_EQ(with(doubtsOf(streetDepth(10, 250, true), 255), "8 bits").flag, "--depth-range NEAR,FAR");
    EXPECT_EQ(with(doubtsOf(streetDepth(0.05, 0.9)), "0 to 1").flag, "--depth-range NEAR,FAR");
    EXPECT_EQ(with(doubtsOf(streetDepth(10, 250, true)), "whole numbers").flag, "--depth-range NEAR,FAR");
    EXPECT_EQ(with(doubtsOf(streetDepth(2000, 30000, true), 65535), "millimetres").flag, "--depth-scale 0.001");
    EXPECT_EQ(with(doubtsOf(streetDepth(20, 65535, true), 65535), "65535").flag,
              "--depth-range NEAR,FAR or --depth-scale 0.001");
    EXPECT_EQ(with(doubtsOf(streetDepth(2000, 30000)), "millimetres").flag, "--depth-scale 0.001");
}

TEST(DepthDoubts, FlagsThatPutItRightSilenceThem)
{
    Settings settings;
    depth::DepthOptions options;
    settings.depthScale = options.scale = 0.001;
    EXPECT_TRUE(doubtsOf(streetDepth(2000, 30000, true), 65535, settings, options).empty());
    settings = {};
    options = {};
    settings.depthRange = {1, 100};
    options.range = settings.depthRange;
    options.full = 255;
    EXPECT_TRUE(doubtsOf(streetDepth(10, 250, true), 255, settings, options).empty());
}

TEST(DepthDoubts, InverseDepthIsFarBelow)
{
    EXPECT_EQ(with(doubtsOf(streetDepth(90, 3)), "lower rows are farther").flag, "--depth-kind inverse");
}

TEST(DepthDoubts, HolesAndSky)
{
    ImageF holes = streetDepth(2, 80);
    for (int y = 0; y < 30; ++y)
        for (int x = 0; x < holes.width(); ++x) holes.at(x, y) = 0;
    EXPECT_EQ(with(doubtsOf(holes), "75 %").severity, Severity::Warning);
    ImageF sky(4, 4, 1);
    for (int i = 0; i < 16; ++i) sky.at(i % 4, i / 4) = kInfinity;
    EXPECT_EQ(with(doubtsOf(sky), "all of it is sky").severity, Severity::Warning);
}

TEST(DepthDoubts, SizesAndShapes)
{
    const io::PlateInfo plate = goodPlate();
    EXPECT_TRUE(depthSizeDoubts(1920, 1080, plate).empty());
    EXPECT_EQ(depthSizeDoubts(960, 540, plate).at(0).severity, Severity::Note);
    EXPECT_EQ(depthSizeDoubts(1024, 768, plate).at(0).severity, Severity::Warning);
    io::PlateInfo odd = plate;
    odd.width = 97;
    odd.height = 55;
    EXPECT_EQ(depthSizeDoubts(48, 27, odd).at(0).severity, Severity::Note);  // rounded halves
}

TEST(PanoramaDoubt, ByShapeAndRange)
{
    EXPECT_EQ(panoramaDoubt(4096, 2048, true).severity, Severity::Ok);
    EXPECT_EQ(panoramaDoubt(1, 1, true).severity, Severity::Ok);
    EXPECT_EQ(panoramaDoubt(4096, 2048, false).severity, Severity::Warning);
    EXPECT_EQ(panoramaDoubt(4096, 1024, true).severity, Severity::Note);
    EXPECT_EQ(panoramaDoubt(4096, 3072, true).severity, Severity::Note);
    EXPECT_EQ(panoramaDoubt(1920, 1080, true).severity, Severity::Error);
    EXPECT_EQ(panoramaDoubt(512, 512, true).severity, Severity::Error);
}

TEST(Preflight, SpaceAndMemoryAreComparedWithWhatThereIs)
{
    constexpr std::uint64_t gb = std::uint64_t(1) << 30;
    EXPECT_EQ(spaceFinding("o.exr", gb, 2 * gb).severity, Severity::Ok);
    const Finding full = spaceFinding("o.exr", 3 * gb, gb / 2);
    EXPECT_EQ(full.severity, Severity::Warning);
    EXPECT_SAYS(full.sentence, "up to 3.0 GB; 512 MB are free");
    EXPECT_EQ(memoryFinding(gb, gb).severity, Severity::Ok);
    EXPECT_EQ(memoryFinding(gb + 1, gb).severity, Severity::Warning);
}

TEST(Preflight, TableAndJsonSayTheSame)
{
    const std::vector<Finding> findings = {{Severity::Ok, "plate", "fine", ""},
                                           {Severity::Warning, "depth", "odd", "--depth-scale 0.001"},
                                           {Severity::Error, "env", "bad \xFF name", ""}};
    EXPECT_TRUE(holdsError(findings));
    EXPECT_FALSE(holdsError({findings[0], findings[1]}));
    const std::string table = findingsTable(findings);
    const auto json = nlohmann::json::parse(findingsJson(findings));
    EXPECT_EQ(json["errors"], 1);
    EXPECT_EQ(json["warnings"], 1);
    ASSERT_EQ(json["findings"].size(), 3u);
    EXPECT_TRUE(json["findings"][0]["flag"].is_null());
    EXPECT_EQ(json["findings"][1]["flag"], "--depth-scale 0.001");
    EXPECT_SAYS(table, "warning  depth       odd  [--depth-scale 0.001]\n");
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 3);
}

}  // namespace
}  // namespace virga::shot
