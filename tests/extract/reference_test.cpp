// The extraction beside solutions computed independently: VIRGA_FOOTAGE_DIR/../reference/em, where that is there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "io/ImageFile.h"
#include "matte/Alternation.h"
#include "matte/RainColor.h"
#include "matte/RainDirection.h"
#include "matte/RainExtraction.h"
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

/// Frames, true alphas and scene of a row of the reference's table.
struct TableRow {
    std::vector<ImageF> frames, alphas;
    ImageF scene;
};

TableRow readRow(const std::string& name)
{
    const std::string path = (folder() / name).string();
    return {readStack(path + "_I.png"), readStack(path + "_alpha_true.png"), readSolution(path + ".f32").trueScene};
}

void addNoise(std::vector<ImageF>& frames, double deviation, unsigned seed)
{
    std::mt19937 engine(seed);
    const auto uniform = [&] { return (double(engine()) + 0.5) / 4294967296.0; };
    for (ImageF& frame : frames)
        for (float& value : frame.values())
            value +=
                float(deviation * std::sqrt(-2 * std::log(uniform())) * std::cos(2 * std::numbers::pi * uniform()));
}

/// Eq. (1), of C = (0.78, 0.80, 0.82).
void film(TableRow& row, double noise, unsigned seed)
{
    constexpr std::array<float, 3> color = {0.78f, 0.80f, 0.82f};
    for (std::size_t k = 0; k < row.frames.size(); ++k)
        for (std::size_t i = 0; i < row.frames[k].size(); ++i) {
            const float a = row.alphas[k].data()[i / 3];
            row.frames[k].data()[i] = (1 - a) * row.scene.data()[i] + a * color[i % 3];
        }
    if (noise > 0) addNoise(row.frames, noise, seed);
}

/// Each frame's strokes with those of three others, shifted around the picture's edges.
void mergeStrokes(TableRow& row, unsigned seed)
{
    std::mt19937 engine(seed);
    const std::vector<ImageF> own = row.alphas;
    for (std::size_t layer = 1; layer < 4; ++layer)
        for (std::size_t k = 0; k < own.size(); ++k) {
            const ImageF& other = own[(k + layer * own.size() / 4) % own.size()];
            const int dx = 12 + int(engine() % (size - 24)), dy = 12 + int(engine() % (size - 24));
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x) {
                    float& alpha = row.alphas[k].at(x, y);
                    alpha = 1 - (1 - alpha) * (1 - other.at((x + dx) % size, (y + dy) % size));
                }
        }
}

struct Scores {
    double alpha, scene, f;
};

/// C and D0 unknown: the defaults.
void expectBetter(TableRow row, double slant, const Scores& limit)
{
    const matte::Extraction found = matte::extractRain(row.frames, {});
    EXPECT_LT(test::rootMeanSquare(found.alphas, row.alphas), limit.alpha);
    EXPECT_LT(test::rootMeanSquare(found.scene, row.scene), limit.scene);
    EXPECT_GT(test::wetDetection(found.alphas, row.alphas).f(), limit.f);
    EXPECT_NEAR(found.direction.slant / degree, slant, 0.3);
    EXPECT_EQ(found.colorSource, matte::ColorSource::Strokes);
    EXPECT_NEAR((found.color[0] + found.color[1] + found.color[2]) / 3, 0.80, 4 * found.colorError);
    EXPECT_LT(found.colorError, 0.06);
    EXPECT_FALSE(found.rose);
}

// Beside the table's 'bounds + linear cost', which was told both: RMSE of alpha, of S, and F1, in each row. Noise of
// 5/255, strokes of 48 % and none of the noise are made from what the reference has.
TEST(Reference, TheDefaultsAreBetterThanTheTable)
{
    if (folder().empty()) GTEST_SKIP() << "VIRGA_FOOTAGE_DIR is not set, or has no ../reference/em beside it";
    const TableRow seven = readRow("slant+7_noise2");
    {
        SCOPED_TRACE("slant 0, noise 0");
        expectBetter(readRow("slant+0_noise0"), 0, {0.0037, 0.0005, 0.988});
    }
    {
        SCOPED_TRACE("slant 0, noise 2");
        expectBetter(readRow("slant+0_noise2"), 0, {0.0060, 0.0020, 0.976});
    }
    {
        SCOPED_TRACE("noise 0");
        TableRow row = seven;
        film(row, 0, 0);
        expectBetter(row, 7, {0.0039, 0.0005, 0.990});
    }
    {
        SCOPED_TRACE("noise 2");
        expectBetter(seven, 7, {0.0060, 0.0019, 0.976});
    }
    {
        SCOPED_TRACE("noise 5");
        TableRow row = seven;
        addNoise(row.frames, std::sqrt(5.0 * 5.0 - 2.0 * 2.0) / 255, 5);
        expectBetter(row, 7, {0.0117, 0.0047, 0.949});
    }
    {
        SCOPED_TRACE("48 % wet");
        TableRow row = seven;
        mergeStrokes(row, 48);
        film(row, 2.0 / 255, 2);
        double wet = 0;
        for (const ImageF& alpha : row.alphas)
            for (const float a : alpha.values()) wet += a > 0.0f ? 1.0 / (count * size * size) : 0.0;
        EXPECT_GT(wet, 0.4);
        expectBetter(row, 7, {0.0134, 0.0048, 0.973});
    }
    {
        SCOPED_TRACE("3 frames");
        TableRow row = seven;
        row.frames.resize(3);
        row.alphas.resize(3);
        expectBetter(row, 7, {0.0082, 0.0051, 0.958});
    }
}

}  // namespace
}  // namespace virga
