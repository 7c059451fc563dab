#include "shot/ReferenceRenderer.h"

#include <algorithm>
#include <glm/matrix.hpp>
#include <utility>

#include "core/Error.h"
#include "core/Timer.h"
#include "reference/DropLight.h"
#include "reference/Picture.h"
#include "reference/UndrawnRain.h"
#include "sh/Panorama.h"
#include "shot/AtlasFile.h"
#include "shot/PixelRepair.h"

namespace virga::shot {
namespace {

[[noreturn]] void refuse(const char* what)
{
    throw Error(ErrorCode::InvalidArgument, "--reference: the reference has no {}", what);
}

Wanted withPanorama(Wanted wanted)
{
    wanted.panorama = true;
    return wanted;
}

/// Blocks of pixels averaged, so that what is left is at most `widest` wide. Rows of a block are of nearly the
/// same solid angle.
ImageF reduced(const ImageF& panorama, int widest)
{
    const int block = (panorama.width() + widest - 1) / widest;
    if (block == 1) return panorama;
    ImageF small((panorama.width() + block - 1) / block, (panorama.height() + block - 1) / block, 3);
    for (int y = 0; y < small.height(); ++y)
        for (int x = 0; x < small.width(); ++x)
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (int j = 0; j < block; ++j)
                    for (int i = 0; i < block; ++i)
                        sum += double(panorama.at(std::min(block * x + i, panorama.width() - 1),
                                                  std::min(block * y + j, panorama.height() - 1), c));
                small.at(x, y, c) = float(sum / (block * block));
            }
    return small;
}

ImageF narrowed(const reference::ImageD& image)
{
    ImageF result(image.width(), image.height(), image.channels());
    std::transform(image.values().begin(), image.values().end(), result.values().begin(),
                   [](double value) { return float(value); });
    return result;
}

}  // namespace

bool drawsAllDrops(const std::string& kind)
{
    if (kind.empty() || kind == "all") return true;
    if (kind == "drawn") return false;
    throw Error(ErrorCode::InvalidArgument,
                "--reference '{}': must be all (every drop) or drawn (the drops that are drawn without it)", kind);
}

struct ReferenceRenderer::Impl : ShotScene {
    Impl(const Settings& s, const Shot& shot_, const Wanted& wanted, const PlateSamples& samples,
         const ReferenceOptions& options_)
        : ShotScene(s, shot_, withPanorama(wanted), samples), options(options_)
    {
    }

    ReferenceOptions options;
    CompositorStatistics statistics;
    std::optional<matte::StrokeAtlas> atlas;
    ImageF panorama;
    std::optional<reference::DropLight> dropLight;
    std::vector<glm::dvec3> lastDirections, lastLight;  // a camera that stands still sees the same light again

    double opticalDepth(double depth_m, const particles::Exposure& exposure) const;
    std::vector<glm::dvec3> lightAlong(std::span<const glm::dvec3> directions);
    void updateLight(const io::PlateFrame& plate);
    reference::Scene sceneAt(const particles::Exposure& exposure);
};

/// As ShotScene::fogOpticalDepth, with the undrawn drops integrated anew.
double ReferenceRenderer::Impl::opticalDepth(double depth_m, const particles::Exposure& exposure) const
{
    if (settings.fog_1_m) return fogOpticalDepth(depth_m, exposure);
    return rain->undrawnEfficiency() *
           reference::undrawnOpticalDepth(fogDepth(depth_m), rain->sizes(), rain->field(), rain->visibility(exposure),
                                          options.allDrops, exposure.projection.fullFocal_px(), exposure.duration_s);
}

std::vector<glm::dvec3> ReferenceRenderer::Impl::lightAlong(std::span<const glm::dvec3> directions)
{
    std::vector<glm::dvec3> turned;
    for (const glm::dvec3& d : directions) turned.push_back(light->environmentFromWorld() * d);
    if (turned != lastDirections) {
        lastLight = (*dropLight)(panorama, turned);
        lastDirections = std::move(turned);
    }
    return lastLight;
}

void ReferenceRenderer::Impl::updateLight(const io::PlateFrame& plate)
{
    const ImageF sampled = light->needsPlate() ? sampledForLight(ImageRows(plate.pixels)) : ImageF();
    if (!light->update(plate.number, viewOf(sampled, plate.number))) return;
    panorama = reduced(light->panorama().pixels, options.widestPanorama);
    lastDirections.clear();
    if (!dropLight)
        dropLight.emplace(panorama.width(), panorama.height(),
                          panorama.width() < 128    ? 4
                          : panorama.width() < 1024 ? 2
                                                    : 1,
                          std::array{optics::waterIndex[0], optics::waterIndex[1], optics::waterIndex[2]});
    statistics.lightSource = lightSource;
}

reference::Scene ReferenceRenderer::Impl::sceneAt(const particles::Exposure& exposure)
{
    reference::Scene scene;
    scene.exposure = exposure;
    scene.focalAtClose_px = projectionAt(exposure.poseAtClose).focal_px;
    scene.darkening = {.desaturate = settings.desaturate, .darken = settings.darken};
    if (plan.features.colorTransfer) scene.colorTransfer = &lut;
    scene.blur_px = settings.blur_px;
    scene.blurDistance_m = settings.blurDistance_m;
    if (!rain) return scene;
    scene.rain.visibility = rain->visibility(exposure);
    if (plan.features.rain) {
        scene.rain.field = &rain->field();
        scene.rain.allDrops = options.allDrops;
        if (plan.features.veil && !options.allDrops) scene.rain.thinnedSizes = &rain->sizes();
        scene.rain.opacity = settings.opacity;
        scene.rain.atlas = atlas ? &*atlas : nullptr;
        scene.rain.aperture_m = lensFocal_m(exposure.projection) / settings.fstop;
        scene.rain.inverseFocus_1_m = 1 / settings.focus_m;
        scene.rain.samples = options.samples;
    }
    if (plan.features.fog) {
        scene.air.opticalDepth = [this, exposure](double depth) { return opticalDepth(depth, exposure); };
        scene.air.openDepth_m = settings.fogDistance_m;
        scene.air.lampExtinction_1_m = settings.fog_1_m.value_or(opticalDepth(100, exposure) / 100);
        if (settings.fogColor)
            scene.air.color = glm::dvec3((*settings.fogColor)[0], (*settings.fogColor)[1], (*settings.fogColor)[2]);
    }
    for (const SceneLight& lamp : lamps) scene.lamps.push_back({lamp.position, lamp.intensity, lamp.radius_m});
    scene.dropLight = [this](std::span<const glm::dvec3> directions) { return lightAlong(directions); };
    scene.behind = [this](std::span<const glm::dvec3> directions) {
        std::vector<glm::dvec3> radiance;
        for (const glm::dvec3& d : directions)
            radiance.push_back(sh::sampleMap(light->lowPassBackground(), light->environmentFromWorld() * d));
        return radiance;
    };
    return scene;
}

ReferenceRenderer::ReferenceRenderer(const Settings& settings, const Shot& shot, const Wanted& wanted,
                                     const PlateSamples& samples, const ReferenceOptions& options)
{
    const FramePlan plan = planFrame(settings, wanted, false);
    if (plan.features.splashes) refuse("splashes: add --splashes 0");
    if (plan.features.light() && settings.paper) refuse("--paper, which is not what it measures");
    if (plan.features.boost) refuse("--background-boost: its light has no order that leaves anything out");
    if (plan.features.light() && io::isFramePattern(settings.env)) refuse("sequence of panoramas: name one with --env");
    if (options.samples < 1 || options.samples > 256)
        throw Error(ErrorCode::InvalidArgument, "--reference-samples '{}': must be 1 to 256", options.samples);
    impl_ = std::make_unique<Impl>(settings, shot, wanted, samples, options);
    if (impl_->plan.features.rain && !options.plainDrops)
        impl_->atlas =
            settings.mattes.empty() ? builtInAtlas(std::uint32_t(settings.seed)) : loadAtlas(settings.mattes);
    impl_->statistics.device = impl_->plan.isPassThrough() ? "" : "the reference";
}

ReferenceRenderer::~ReferenceRenderer() = default;
const FramePlan& ReferenceRenderer::plan() const { return impl_->plan; }
const CompositorStatistics& ReferenceRenderer::statistics() const { return impl_->statistics; }

io::RenderedFrame ReferenceRenderer::render(io::PlateFrame plate, std::shared_ptr<RowSink>)
{
    Impl& m = *impl_;
    const Timer clock;
    io::RenderedFrame out;
    out.number = plate.number;
    out.extras = plate.extras;
    ++m.statistics.frames;
    if (m.plan.isPassThrough()) {
        out.beauty = std::move(plate.pixels);
        return out;
    }
    m.statistics.repairedPixels += repairPixels(plate.pixels);
    const particles::Exposure exposure = m.exposureAt(double(plate.number));
    std::shared_ptr<const depth::Depth> depth;
    if (m.plan.features.depth) {
        depth = m.depthAt(plate.number, exposure, plate.pixels);
        m.statistics.depthCounts = depth->counts;
        m.statistics.depthResampled = depth->resampled;
    }
    if (m.light) m.updateLight(plate);
    const reference::Scene scene = m.sceneAt(exposure);
    const reference::Picture picture =
        reference::render(scene, plate.pixels, depth ? ConstImageViewF(depth->metres) : ConstImageViewF());
    m.statistics.strokes += picture.strokes;
    m.statistics.fogExtinction_1_m = scene.air.lampExtinction_1_m;

    out.beauty = narrowed(picture.beauty);
    if (m.plan.features.layers) {
        const std::vector<std::string> rgba = {"R", "G", "B", "A"};
        out.layers.push_back({"rain", rgba, narrowed(picture.rain)});
        out.layers.push_back({"splash", rgba, ImageF(m.shot.width, m.shot.height, 4)});
        out.layers.push_back({"fog", rgba, narrowed(picture.fog)});
        out.layers.push_back({"plate", rgba, narrowed(picture.plate)});
        if (m.plan.features.nearest) {
            out.layers.push_back({"rain", {"Z"}, narrowed(picture.nearestDepth), true});
            out.layers.push_back({"rain.motion", {"x", "y"}, narrowed(picture.nearestMotion), true});
        }
    }
    m.statistics.passMs["reference"] += clock.milliseconds();
    m.statistics.renderSeconds += clock.seconds();
    return out;
}

}  // namespace virga::shot
