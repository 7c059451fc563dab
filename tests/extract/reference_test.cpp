// The extraction beside solutions computed independently: VIRGA_FOOTAGE_DIR/../reference/em, where that is there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "io/ImageFile.h"
#include "matte/Alternation.h"
#include "matte/RainColor.h"
#include "matte/RainDirection.h"
#include "matte/SceneTrust.h"
#include "support/Scores.h"

namespace virga {
namespace {

using matte::Alternation;
using matte::AlternationOptions;

constexpr double degree = std::numbers::pi / 180.0;
constexpr int size = 96, count = 20;

std::filesystem::path folder()
{
    const char* footage = std::getenv("VIRGA_FOOTAGE_DIR");
    const std::filesystem::path path = footage ? std::filesystem::path(footage) / ".." / "reference" / "em" : "";
    return std::filesystem::is_directory(path) ? path : std::filesystem::path();
}

/// Frames stacked top to bottom, cut apart.
std::vector<ImageF> readStack(const std::filesystem::path& file)
{
    io::ImageHeader header;
    const ImageF stack = io::readAllChannels(file.string(), header, true);
    std::vector<ImageF> frames;
    for (int k = 0; k < count; ++k) {
        ImageF frame(size, size, stack.channels());
        std::copy_n(stack.row(k * size), frame.size(), frame.data());
        frames.push_back(std::move(frame));
    }
    return frames;
}

struct Solution {
    ImageF trueScene{size, size, 3}, scene{size, size, 3};
    std::vector<ImageF> alphas;
};

Solution readSolution(const std::filesystem::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    Solution s;
    const auto read = [&](ImageF& image) {
        stream.read(reinterpret_cast<char*>(image.data()), std::streamsize(image.size() * sizeof(float)));
    };
    read(s.trueScene);
    read(s.scene);
    for (int k = 0; k < count; ++k) {
        s.alphas.emplace_back(size, size, 1);
        read(s.alphas.back());
    }
    EXPECT_TRUE(stream) << file;
    return s;
}

double largestDifference(const ImageF& a, const ImageF& b)
{
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(double(a.data()[i]) - b.data()[i]));
    return largest;
}

double largestDifference(const std::vector<ImageF>& a, const std::vector<ImageF>& b)
{
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, largestDifference(a[k], b[k]));
    return largest;
}

struct Case {
    const char* name;
    double slant;
    double firstTotal, lastTotal;  // F after the first and the last iteration; 0 = not looked at
};

AlternationOptions reference(double slant)
{
    AlternationOptions options;
    options.terms.color = {0.78f, 0.80f, 0.82f};
    options.terms.slant = slant * degree;
    options.stepTolerance = 1e-9;
    return options;
}

TEST(Reference, ThePapersAlternation)
{
    if (folder().empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or has no ../reference/em beside it";
    for (const Case& c : {Case{"slant+0_noise0", 0, 0, 0}, Case{"slant+0_noise2", 0, 0, 0},
                          Case{"slant+7_noise2", 7, 37.95385390095629, 37.60394854001961}}) {
        SCOPED_TRACE(c.name);
        const auto frames = readStack(folder() / (std::string(c.name) + "_I.png"));
        const Solution expected = readSolution(folder() / (std::string(c.name) + ".f32"));
        AlternationOptions options = reference(c.slant);
        options.terms.bounded = false;
        const Alternation found = alternate({frames}, options);
        EXPECT_LT(largestDifference(found.scene, expected.scene), 1e-5);
        EXPECT_LT(largestDifference(found.alphas, expected.alphas), 1e-5);
        EXPECT_FALSE(found.rose);
        ASSERT_EQ(found.history.size(), 20u);
        if (c.firstTotal > 0) {
            EXPECT_NEAR(found.history.front().total(), c.firstTotal, 1e-6 * c.firstTotal);
            EXPECT_NEAR(found.history.back().total(), c.lastTotal, 1e-6 * c.lastTotal);
        }
    }
}

TEST(Reference, BoundsAndALinearCost)
{
    if (folder().empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or has no ../reference/em beside it";
    for (const Case& c : {Case{"slant+0_noise2", 0, 0, 0}, Case{"slant+7_noise2", 7, 0, 80.46731551809549}}) {
        SCOPED_TRACE(c.name);
        const auto frames = readStack(folder() / (std::string(c.name) + "_I.png"));
        const Solution expected = readSolution(folder() / (std::string(c.name) + "_box.f32"));
        AlternationOptions options = reference(c.slant);
        options.terms.eta = 0.003411764705882353;
        options.tolerance = 1e-10;
        options.iterations = 60;
        const Alternation found = alternate({frames}, options);
        EXPECT_LT(largestDifference(found.scene, expected.scene), 1e-4);
        EXPECT_LT(largestDifference(found.alphas, expected.alphas), 1e-4);
        EXPECT_FALSE(found.rose);
        if (c.lastTotal > 0) {
            EXPECT_NEAR(found.history.back().total(), c.lastTotal, 1e-7 * c.lastTotal);
        }
    }
}

// With the direction unknown, and steps that end early.
TEST(Reference, TheSlantIsFoundOnTheWay)
{
    if (folder().empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or has no ../reference/em beside it";
    struct Row {
        const char* name;
        double slant, eta, alphaError, sceneError, wet;
    };
    for (const Row& row : {Row{"slant+0_noise0", 0, 0.001, 0.003725, 0.000521, 0.98798},
                           Row{"slant+0_noise2", 0, 0.0034118, 0.006021, 0.001952, 0.97577},
                           Row{"slant+7_noise2", 7, 0.0034118, 0.005993, 0.001943, 0.97642}}) {
        SCOPED_TRACE(row.name);
        const auto frames = readStack(folder() / (std::string(row.name) + "_I.png"));
        const auto truth = readStack(folder() / (std::string(row.name) + "_alpha_true.png"));
        const ImageF trueScene = readSolution(folder() / (std::string(row.name) + ".f32")).trueScene;
        AlternationOptions options = reference(row.slant);
        options.terms.eta = row.eta;
        options.findSlant = true;
        options.stepTolerance = 1e-4;
        const Alternation found = alternate({frames}, options);
        EXPECT_LT(test::rootMeanSquare(found.alphas, truth), row.alphaError * 1.01);
        EXPECT_LT(test::rootMeanSquare(found.scene, trueScene), row.sceneError * 1.01);
        EXPECT_GT(test::wetDetection(found.alphas, truth).f(), row.wet - 0.001);
        EXPECT_FALSE(found.rose);
        EXPECT_NEAR(found.slant / degree, row.slant, 0.15);
        EXPECT_NEAR(matte::rainDirection(truth).slant / degree, row.slant, 0.15);
    }
}

// C from the strokes and the scene in turn, from a wrong one: within 0.035, the limit being what alpha's cost does to
// the scene.
TEST(Reference, TheRainsColorIsFound)
{
    if (folder().empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or has no ../reference/em beside it";
    for (const Case& c :
         {Case{"slant+0_noise0", 0, 0, 0}, Case{"slant+0_noise2", 0, 0, 0}, Case{"slant+7_noise2", 7, 0, 0}}) {
        SCOPED_TRACE(c.name);
        const auto frames = readStack(folder() / (std::string(c.name) + "_I.png"));
        AlternationOptions options = reference(c.slant);
        options.terms.color = {0.9f, 0.9f, 0.9f};
        options.terms.eta = 0.0034;
        options.iterations = 6;
        matte::RainColor color;
        for (int round = 0; round < 3; ++round) {
            const Alternation found = matte::alternate({frames}, options);
            color = matte::rainColor({frames}, found.scene, c.slant * degree, matte::noiseLevel(frames, found.scene));
            options.terms.color = color.color;
        }
        ASSERT_TRUE(color.found);
        EXPECT_NEAR(color.color[0], 0.78, 0.035);
        EXPECT_NEAR(color.color[1], 0.80, 0.035);
        EXPECT_NEAR(color.color[2], 0.82, 0.035);
        EXPECT_LT(color.error, 0.03);
    }
}

}  // namespace
}  // namespace virga
