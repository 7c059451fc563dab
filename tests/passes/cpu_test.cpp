#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string_view>

#include "core/Parallel.h"
#include "passes/CpuRenderer.h"
#include "passes/Picture.h"
#include "passes/SplashPass.h"
#include "rainfall/DropSizes.h"

namespace virga::passes {
namespace {

constexpr int width = 203, height = 131;  // neither a multiple of the lanes nor of the bands

/// A rain of 50 mm/h with wind and turbulence, seen by a camera that turns.
struct Scene {
    particles::Exposure exposure;
    particles::Visibility visibility{.near_m = 0.3, .far_m = 100, .threshold = 0.002};
    shared::FrameConstants constants{};
    particles::CellList cells;
    ImageF plate{width, height, 4}, depth{width, height, 1}, radiance{32, 16, 3}, background{32, 16, 3};
    std::vector<float> fogTable, veilTable, ringTransfer, lut;
    std::vector<shared::PointLight> lamps{{{1, 1, -6, 0.1f}, {2, 1, 0.5f, 0}}, {{-2, 0.3f, -15, 0.2f}, {9, 9, 12, 0}}};

    explicit Scene(double exposure_s)
    {
        exposure.duration_s = exposure_s;
        exposure.open_s = 3;
        exposure.projection = camera::projectionFromHorizontalFov(width, height, 1.2);
        exposure.poseAtClose = camera::pitchedPose({0.02, 0, 0.01}, 0.01);
        const rainfall::DropSizes sizes(50);
        const particles::Motion motion({.wind = {3, 1}, .gust = 0.3, .turbulence = 0.4});
        const particles::RainField field(rainfall::makeSizeClasses(sizes), sizes.slope(), motion, 7, 4);
        cells = field.cellsInView(exposure, visibility);

        const auto rotation = [](const camera::Pose& pose) {
            return glm::mat4(glm::mat3(glm::transpose(pose.worldFromCamera)));
        };
        constants.cameraFromWorldOpen = rotation(exposure.poseAtOpen);
        constants.cameraFromWorldClose = rotation(exposure.poseAtClose);
        const auto focal = float(exposure.projection.focal_px);
        constants.lens = {focal, 1.01f * focal, 0.5f * width, 0.5f * height};
        constants.range = {0.3f, 100, 0.002f, 0.9f};
        constants.focus = {0.01f, 0.3f, float(exposure_s), 20};  // near drops are blurred
        constants.picture = {width, height, 0, 0};
        constants.boost = {0.4f, 0, 0.3f, focal};
        constants.splash = {3, 0.12f, 1, 0.4f};
        constants.splashGrid = {0.1f, 0.03f, 0.02f, 1};
        constants.splashKey = {9, 5, 6, std::uint32_t(SplashPass::capacity(width, height))};
        constants.splashTime = {70, 12, 0, 0};
        constants.splashDrop = {1e-3f, 8e-3f, 2000, 60};
        constants.grade = {0.2f, 0.3f, 2.3f, 20};
        constants.lights.x = std::uint32_t(lamps.size());
        constants.lut = {0.02f, 2, 9, 0};

        std::mt19937 random(5);
        std::uniform_real_distribution<float> unit(0, 1);
        for (float& value : plate.values()) value = 2 * unit(random);
        for (float& value : radiance.values()) value = 3 * unit(random);
        for (float& value : background.values()) value = unit(random);
        // Sky at the left, a wall of noise, and a road 1.5 m under the camera.
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                depth.at(x, y) = y > height / 2 + 10 ? 1.5f * focal / (float(y) + 0.5f - 0.5f * height)
                                 : x < 40            ? std::numeric_limits<float>::infinity()
                                                     : 1 + 30 * unit(random);
        // Smooth, as a device's arc cosine has its own rounding.
        for (int i = 0; i < 3 * 256; ++i) ringTransfer.push_back(0.2f + 0.1f * std::cos(float(i) / 300));
        for (int i = 0; i < 3 * 9 * 9 * 9; ++i) lut.push_back(0.2f * (unit(random) - 0.5f));
        for (int i = 0; i < shared::fogTableSize; ++i) {
            fogTable.push_back(1.5f * float(i) / 255);
            veilTable.insert(veilTable.end(), {0.3f * float(std::max(i - 9, 0)) / 246, 0.2f * float(i) / 255});
        }
        constants.medium = {0.02f, 0, 0.3f, 0.2f};
    }
};

struct Result {
    ImageF beauty;
    std::vector<std::pair<const char*, ImageF>> layers;
    std::size_t strokes = 0, splashes = 0;
};

Result byShaders(Features features, const Scene& scene)
{
    features = test::onSoftware(features);
    FrameTargets targets(width, height, features);
    std::optional<StrokePass> strokes;
    if (features.rain) strokes.emplace(features, test::atlas(1));
    std::optional<LightPass> light;
    if (features.light()) light.emplace(features);
    const CompositePass composite(features);
    std::optional<SplashPass> splashes;
    if (features.splashes) splashes.emplace(features);
    targets.uploadPlate(scene.plate);
    if (features.depth) targets.uploadDepth(scene.depth);
    if (features.fog) targets.uploadFogTable(scene.fogTable);
    if (features.veil) targets.uploadVeilTable(scene.veilTable);
    std::optional<BlurPass> blur;
    if (features.blur) blur.emplace(features);
    if (features.lights) targets.uploadRingTransfer(scene.ringTransfer);
    if (features.lights) targets.uploadLights(scene.lamps);
    if (features.colorTransfer) targets.uploadLut(9, scene.lut);
    if (features.light()) targets.uploadDropRadiance(scene.radiance, scene.background);
    shared::FrameConstants constants = scene.constants;
    if (strokes) strokes->describe(constants, scene.cells);
    targets.setConstants(constants);
    targets.bind();
    gl::PassTimer timer;
    timer.begin();
    if (light) light->run(targets);
    if (blur) blur->run(targets);
    if (splashes) splashes->run(targets);
    if (strokes) strokes->run(targets, scene.cells, timer);
    composite.run(targets);
    Result result;
    result.beauty = targets.readBeauty();
    if (strokes) result.strokes = strokes->strokeCount();
    if (splashes) result.splashes = splashes->splashCount();
    using Layer = FrameTargets::LayerIndex;
    if (features.layers && features.rain) result.layers.emplace_back("rain", targets.readLayer(Layer::Rain));
    if (features.layers && features.splashes) result.layers.emplace_back("splash", targets.readLayer(Layer::Splash));
    if (features.layers && features.fog) result.layers.emplace_back("fog", targets.readLayer(Layer::Fog));
    if (features.layers) result.layers.emplace_back("plate", targets.readLayer(Layer::Plate));
    if (features.nearest) result.layers.emplace_back("depth", targets.readNearestDepth());
    if (features.nearest) result.layers.emplace_back("motion", targets.readNearestMotion());
    return result;
}

Result byCpu(const Features& features, const Scene& scene)
{
    CpuRenderer renderer(width, height, features, test::atlas(1));
    renderer.setDepth(scene.depth);
    renderer.setFogTable(scene.fogTable);
    renderer.setVeilTable(scene.veilTable);
    renderer.setRingTransfer(scene.ringTransfer);
    renderer.setLamps(scene.lamps);
    renderer.setLut(scene.lut);
    renderer.setDropRadiance(scene.radiance, scene.background);
    Result result;
    result.beauty = scene.plate;
    renderer.render(result.beauty.view(), scene.constants, scene.cells);
    result.strokes = renderer.strokeCount();
    result.splashes = renderer.splashCount();
    if (features.layers && features.rain) result.layers.emplace_back("rain", renderer.takeRain());
    if (features.layers && features.splashes) result.layers.emplace_back("splash", renderer.takeSplash());
    if (features.layers && features.fog) result.layers.emplace_back("fog", renderer.takeFog());
    if (features.layers) result.layers.emplace_back("plate", renderer.takePlate());
    if (features.nearest) result.layers.emplace_back("depth", renderer.takeNearestDepth());
    if (features.nearest) result.layers.emplace_back("motion", renderer.takeNearestMotion());
    return result;
}

/// An image filled by rows, and how often each of them came.
class Canvas final : public RowSink {
public:
    void write(int firstRow, ConstImageViewF rgba) override
    {
        EXPECT_EQ(firstRow % rowsPerChroma, 0);
        EXPECT_TRUE(rgba.height() % rowsPerChroma == 0 || firstRow + rgba.height() == height);
        for (int y = 0; y < rgba.height(); ++y) {
            std::copy_n(rgba.row(y), 4 * width, picture.row(firstRow + y));
            ++times.at(std::size_t(firstRow + y));
        }
    }
    ImageF picture{width, height, 4};
    std::vector<int> times = std::vector<int>(height);
};

/// Pixels where the images differ by more than `tolerance` of the larger value (or of 1).
std::size_t differing(const ImageF& a, const ImageF& b, double tolerance)
{
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double x = a.data()[i], y = b.data()[i];
        if (x == y) continue;  // infinity too
        count += !(std::abs(x - y) <= tolerance * std::max({1.0, std::abs(x), std::abs(y)}));
    }
    return count;
}

/// Every feature alone and with all others, and as many again by chance: the shaders are compiled for each.
std::vector<Features> manyCombinations()
{
    constexpr unsigned bits = 12, all = (1u << bits) - 1;
    std::vector<unsigned> masks = {all};
    for (unsigned bit = 0; bit < bits; ++bit)
        masks.insert(masks.end(), {1u << bit, all & ~(1u << bit), 1u | (1u << bit)});
    std::mt19937 random(3);
    for (int i = 0; i < 40; ++i) masks.push_back(random() & all);
    std::vector<Features> combinations;
    for (const unsigned mask : masks) {
        const auto has = [&](unsigned bit) { return (mask >> bit & 1) != 0; };
        Features f;
        f.rain = has(0), f.fog = has(1), f.depth = has(2), f.darken = has(3), f.blur = has(4), f.colorTransfer = has(5);
        f.splashes = has(6) && f.depth;
        f.boost = has(7) && (f.rain || f.splashes);
        f.lights = has(8) && f.light();
        f.cameraMotion = has(9) && f.rain;
        f.layers = has(10);
        f.nearest = f.layers && f.rain;
        f.veil = has(11) && f.rain;
        if (f.anything()) combinations.push_back(f);
    }
    return combinations;
}

std::string wordsOf(const Features& f)
{
    std::string words;
    const auto add = [&](bool is, const char* word) { words += is ? word : ""; };
    add(f.rain, "rain "), add(f.fog, "fog "), add(f.depth, "depth "), add(f.darken, "darken "), add(f.boost, "boost ");
    add(f.blur, "blur "), add(f.colorTransfer, "transfer "), add(f.lights, "lamps "), add(f.splashes, "splashes "),
        add(f.layers, "layers "), add(f.cameraMotion, "motion "), add(f.veil, "veil");
    return words;
}

// Where float rounds a drop over an edge (of a pixel, of its cell's visible depth), a sum differs by a step or a stroke
// by a row: a few pixels of a picture, not more.
TEST(CpuRenderer, DrawsWhatTheShadersDraw)
{
    const gl::Context context("cpu");
    for (const double exposure_s : {1 / 200.0, 1 / 40.0}) {
        Scene scene(exposure_s);
        ASSERT_GT(scene.cells.drops, 1000u);
        for (const Features& f : manyCombinations()) {
            SCOPED_TRACE(wordsOf(f));
            scene.constants.medium.y = f.veil ? 0.02f : 0.0f;
            const Result shaders = byShaders(f, scene), cpu = byCpu(f, scene);
            EXPECT_NEAR(double(cpu.strokes), double(shaders.strokes), 2e-4 * double(shaders.strokes) + 1);
            EXPECT_NEAR(double(cpu.splashes), double(shaders.splashes), 2e-3 * double(shaders.splashes) + 1);
            const std::size_t few = shaders.beauty.size() / 5000;
            EXPECT_LE(differing(cpu.beauty, shaders.beauty, 1e-5), few);
            ASSERT_EQ(cpu.layers.size(), shaders.layers.size());
            for (std::size_t i = 0; i < cpu.layers.size(); ++i) {
                const auto& [name, image] = cpu.layers[i];
                const double tolerance = std::string_view(name) == "motion" ? 0x1p-10 : 1e-5;  // motion is in halves
                EXPECT_LE(differing(image, shaders.layers[i].second, tolerance), few) << name;
            }
        }
    }
}

TEST(CpuRenderer, SameBitsOnAnyNumberOfThreads)
{
    const Scene scene(1 / 100.0);
    Features f;
    f.rain = f.fog = f.depth = f.darken = f.boost = f.layers = f.nearest = true;
    const Result many = byCpu(f, scene);
    const ThreadLimit one(1);
    const Result single = byCpu(f, scene);
    EXPECT_EQ(differing(many.beauty, single.beauty, 0), 0u);
    for (std::size_t i = 0; i < many.layers.size(); ++i)
        EXPECT_EQ(differing(many.layers[i].second, single.layers[i].second, 0), 0u) << many.layers[i].first;
}

TEST(CpuRenderer, APixelThatNoDropReachesIsNotTouched)
{
    Scene scene(1 / 200.0);
    scene.constants.range.z = 0.1f;  // strong strokes alone, so that there is room between them
    scene.plate.at(50, 60, 0) = std::numeric_limits<float>::quiet_NaN();  // would not come through arithmetic
    Features f;
    f.rain = f.layers = f.nearest = true;
    const Result layered = byCpu(f, scene);
    f.layers = f.nearest = false;
    const Result result = byCpu(f, scene);
    const ImageF& rain = layered.layers[0].second;
    std::size_t untouched = 0;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            if (rain.at(x, y, 3) > 0) continue;
            ++untouched;
            EXPECT_EQ(std::memcmp(result.beauty.pixel(x, y), scene.plate.pixel(x, y), 16), 0) << x << " " << y;
        }
    EXPECT_GT(untouched, 1000u);
}

TEST(CpuRenderer, LayersOverEachOtherAreTheBeauty)
{
    const Scene scene(1 / 100.0);
    Features f;
    f.rain = f.fog = f.depth = f.darken = f.boost = f.layers = f.nearest = true;
    const Result r = byCpu(f, scene);
    const ImageF &rain = r.layers[0].second, &fog = r.layers[1].second, &plate = r.layers[2].second;
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int c = 0; c < 4; ++c) {
                const float under = fog.at(x, y, c) + (1 - fog.at(x, y, 3)) * plate.at(x, y, c);
                const float all = rain.at(x, y, c) + (1 - rain.at(x, y, 3)) * under;
                ASSERT_NEAR(all, r.beauty.at(x, y, c), 1e-5 * std::max(1.0f, std::abs(all)));
            }
}

// Light between codes and codes lives in a few rows at a time; what is drawn over it there is what is drawn over a
// whole picture, to the bit, whatever the features.
TEST(CpuRenderer, RowsGiveWhatAWholePictureGives)
{
    const Scene scene(1.0 / 60);
    for (const Features& features : manyCombinations()) {
        if (features.blur) continue;
        const Result whole = byCpu(features, scene);
        CpuRenderer renderer(width, height, features, test::atlas(1));
        renderer.setDepth(scene.depth);
        renderer.setFogTable(scene.fogTable);
        renderer.setRingTransfer(scene.ringTransfer);
        renderer.setLamps(scene.lamps);
        renderer.setLut(scene.lut);
        renderer.setDropRadiance(scene.radiance, scene.background);
        renderer.setVeilTable(scene.veilTable);
        Canvas canvas;
        renderer.render(ImageRows(scene.plate), canvas, scene.constants, scene.cells);
        EXPECT_EQ(canvas.times, std::vector<int>(height, 1));
        EXPECT_EQ(differing(whole.beauty, canvas.picture, 0), 0u);
        EXPECT_EQ(renderer.strokeCount(), whole.strokes);
        if (features.layers && features.rain) {
            EXPECT_EQ(differing(renderer.takeRain(), whole.layers[0].second, 0), 0u);
        }
        EXPECT_TRUE(renderer.passMs().contains("conversion"));
    }
}

}  // namespace
}  // namespace virga::passes
