#include "bench/PlainRain.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "core/Timer.h"
#include "rainfall/TerminalSpeed.h"
#include "shot/LampReach.h"

namespace virga::bench {
namespace {

const particles::MotionSettings weather{.wind = {0.8, 0.0}, .gust = 0.3, .turbulence = 0.25};

/// One drop a cubic metre.
rainfall::SizeClass onlySize(double diameter)
{
    const double square = diameter * diameter;
    return {.d0 = diameter,
            .d1 = diameter,
            .numberPerVolume = 1,
            .speed = rainfall::terminalSpeed(diameter),
            .speedError = 0,
            .meanDiameter = diameter,
            .meanSquare = square,
            .meanCube = square * diameter,
            .weight = 1};
}

ImageF groundDepth(int width, int height, double focal_px)
{
    ImageF depth(width, height, 1, std::numeric_limits<float>::infinity());
    for (int y = height / 2 + 1; y < height; ++y)
        for (int x = 0; x < width; ++x) depth.at(x, y) = float(1.6 * focal_px / (y + 0.5 - 0.5 * height));
    return depth;
}

shared::FrameConstants constantsOf(const PlainScene& scene, const camera::Projection& projection)
{
    shared::FrameConstants constants{};
    constants.cameraFromWorldOpen = constants.cameraFromWorldClose = glm::mat4(1.0f);
    const auto focal = float(projection.focal_px);
    constants.lens = {focal, focal, 0.5f * float(scene.width), 0.5f * float(scene.height)};
    constants.range = {float(scene.visibility.near_m), float(scene.visibility.far_m), float(scene.visibility.threshold),
                       1};
    constants.boost.w = focal;
    constants.focus = {0, 0.1f, float(scene.exposure_s), 20};
    constants.picture = {scene.width, scene.height, 0, 0};
    constants.lights.x = scene.lamps ? 1 : 0;
    constants.medium.x = scene.lamps ? 0.005f : 0.0f;
    return constants;
}

}  // namespace

particles::Exposure exposureOf(const PlainScene& scene, int frame)
{
    particles::Exposure exposure;
    exposure.open_s = frame / 24.0;
    exposure.duration_s = scene.exposure_s;
    exposure.projection =
        camera::projectionFromHorizontalFov(scene.width, scene.height, scene.fov_deg * std::numbers::pi / 180);
    return exposure;
}

particles::RainField fieldOfRate(double rate_mm_h, std::uint32_t seed, double densityScale, double dropsPerCell,
                                 int classes)
{
    const rainfall::DropSizes sizes(rate_mm_h);
    return {rainfall::makeSizeClasses(sizes, {.count = classes}),
            sizes.slope(),
            particles::Motion(weather),
            seed,
            densityScale,
            dropsPerCell};
}

particles::RainField fieldOfSize(double diameter, const PlainScene& scene, double strokes, std::uint32_t seed)
{
    constexpr double slope = 2000;  // of no effect on one size
    const particles::RainField one({onlySize(diameter)}, slope, particles::Motion(weather), seed);
    const double expected = one.expectedStrokes(exposureOf(scene, 0).projection, scene.exposure_s, scene.visibility);
    return {{onlySize(diameter)},       slope,
            particles::Motion(weather), seed,
            strokes / expected,         particles::RainField::dropsPerCellFor(strokes)};
}

PlainRain::PlainRain(const PlainScene& scene, const matte::StrokeAtlas& atlas, const std::string& device)
    : scene_(scene)
{
    passes::Features features;
    features.rain = true;
    features.fog = features.depth = scene.environment;
    features.lights = scene.lamps;
    features.layers = scene.layers;
    const std::vector<float> ringTransfer = scene.lamps ? shot::ringTransferTable() : std::vector<float>();
    renderer_ = shot::makePictureRenderer(
        {scene.width, scene.height, features, atlas, grade::ColorLut{}, ringTransfer, device, {}});
    if (scene.environment) {
        depth_ = groundDepth(scene.width, scene.height, exposureOf(scene, 0).projection.focal_px);
        renderer_->setDepth(depth_);
        renderer_->setFogTable(std::vector<float>(shared::fogTableSize, 0.05f));
    }
    const ImageF white(64, 32, 3, 0.9f);
    renderer_->setDropRadiance(white, white);
    const shared::PointLight lamp{{1, 1, -6, 0.1f}, {2, 1, 0.5f, 0}};
    if (scene.lamps) renderer_->setLamps({&lamp, 1});
}

double PlainRain::Frame::passMs(const std::string& name) const
{
    const auto found = picture.passMs.find(name);
    return found == picture.passMs.end() ? 0 : found->second;
}

PlainRain::Frame PlainRain::render(const particles::RainField& field, int frame)
{
    const particles::Exposure exposure = exposureOf(scene_, frame);
    ImageF plate(scene_.width, scene_.height, 4, 0.05f);
    const Timer clock;
    const particles::CellList cells = field.cellsInView(exposure, scene_.visibility);
    Frame result;
    result.cells_ms = clock.milliseconds();
    result.listed = cells.drops;
    result.picture = renderer_->render({.pixels = std::move(plate), .rows = nullptr, .canvas = nullptr},
                                       constantsOf(scene_, exposure.projection), cells, glm::mat3(1.0f), {});
    result.all_ms = clock.milliseconds();
    return result;
}

double medianOf(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
    return values[values.size() / 2];
}

}  // namespace virga::bench
