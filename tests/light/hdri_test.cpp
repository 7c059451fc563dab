// Real panoramas, from file to shader: VIRGA_FOOTAGE_DIR/hdri, where that is set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "environment/DropRadiance.h"
#include "environment/Panorama.h"
#include "gl/Context.h"
#include "io/Plate.h"
#include "reference/DropLight.h"
#include "support/ShaderLookup.h"

namespace virga {
namespace {

using environment::DropRadiance;
using environment::DropRadianceBaker;

std::vector<std::filesystem::path> panoramas()
{
    std::vector<std::filesystem::path> files;
    if (const char* folder = std::getenv("VIRGA_FOOTAGE_DIR")) {
        const std::filesystem::path hdri = std::filesystem::path(folder) / "hdri";
        if (std::filesystem::is_directory(hdri))
            for (const auto& entry : std::filesystem::directory_iterator(hdri))
                if (entry.path().extension() == ".exr") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

environment::Panorama readPanorama(const std::filesystem::path& file)
{
    return environment::preparePanorama(io::readLinearImage(file.string()), file.string());
}

// Stroke by stroke beside brute force: under 1 % of the mean, root mean square, with the default options.
TEST(Hdri, TheDefaultIsWithinAPerCentOfTheIntegral)
{
    const auto files = panoramas();
    if (files.empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or holds no hdri/*.exr";
    const DropRadianceBaker baker;
    std::vector<glm::dvec3> views;
    for (const glm::vec3& d : test::scatteredDirections(100)) views.emplace_back(d);
    for (const auto& file : files) {
        const environment::Panorama panorama = readPanorama(file);
        const DropRadiance light = baker.bake(panorama);
        const reference::DropLight integral(panorama.pixels.width(), panorama.pixels.height(), 2,
                                            baker.options().index);
        const auto truth = integral(panorama.pixels, views);
        double square = 0, mean = 0;
        for (std::size_t i = 0; i < views.size(); ++i) {
            const glm::dvec3 e = environment::sampleMap(light.radiance, views[i]) - truth[i];
            square += glm::dot(e, e) / (3.0 * double(views.size()));
            mean += (truth[i].r + truth[i].g + truth[i].b) / (3.0 * double(views.size()));
        }
        EXPECT_LT(std::sqrt(square) / mean, 0.01) << file.filename();
    }
}

TEST(Hdri, ShaderAndCpuLookUpTheSame)
{
    const auto files = panoramas();
    if (files.empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or holds no hdri/*.exr";
    const gl::Context context("auto");
    const test::ShaderLookup lookup;
    const DropRadianceBaker baker;
    const std::vector<glm::vec3> directions = test::scatteredDirections(10000);
    for (const auto& file : files) {
        const DropRadiance light = baker.bake(readPanorama(file));
        for (const ImageF* map : {&light.radiance, &light.background}) {
            const std::vector<glm::vec4> found = lookup(*map, directions);
            double worst = 0;
            for (std::size_t i = 0; i < directions.size(); ++i) {
                const glm::dvec3 expected = environment::sampleMap(*map, directions[i]);
                for (int c = 0; c < 3; ++c) {
                    worst = std::max(worst, std::abs(double(found[i][c]) - expected[c]) / expected[c]);
                }
            }
            EXPECT_LT(worst, 1e-4) << file.filename();
        }
    }
}

}  // namespace
}  // namespace virga
