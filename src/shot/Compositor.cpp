#include "shot/Compositor.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "core/Parallel.h"
#include "core/Timer.h"
#include "passes/SplashPass.h"
#include "shot/AtlasFile.h"
#include "shot/LampReach.h"
#include "shot/PictureRenderer.h"
#include "shot/PixelRepair.h"

namespace virga::shot {
namespace {

/// Depth of the middle entry of the fog and veil tables [m].
constexpr double fogTableScale = 20;
constexpr std::size_t tableSize = shared::fogTableSize;

double depthOfEntry(std::size_t entry)
{
    const double place = double(entry) / double(tableSize - 1);
    return place < 1 ? fogTableScale * place / (1 - place) : std::numeric_limits<double>::infinity();
}

}  // namespace

struct Compositor::Impl : ShotScene {
    Impl(const Settings& settings_, const Shot& shot_, const CompositorOptions& options, const PlateSamples& samples)
        : ShotScene(settings_, shot_, options.wanted, samples, KeptFiles(options.cacheFolder)), wanted(options.wanted)
    {
    }

    Wanted wanted;
    CompositorStatistics statistics;

    std::unique_ptr<PictureRenderer> renderer;
    std::atomic<std::size_t> repairedInRows = 0;

    Timeline* timeline = nullptr;
    struct Handed {
        FrameNumber frame;
        Timeline::Clock::time_point start;
    };
    std::deque<Handed> inFlight;              // frames that are not complete, oldest first
    Timeline::Clock::time_point passesEnd{};  // of the passes on the timeline
    std::shared_ptr<const depth::Depth> usedDepth;
    double tablesFocal = -1;  // focal length that the tables in use were made for [px]
    std::vector<float> fogTable, veilTable;
    std::optional<particles::FarthestDepth> farthestDepth;  // of usedDepth
    std::vector<float> ringTransfer;                        // features.lights
    std::size_t lampsInUse = 0;
    double matteWidthDiameters = 1;
    double greatestTransfer = 0;    // of ringTransfer [1/sr]
    std::uint64_t lastContent = 0;  // of the plate frame that was rendered last; 0: it came to nothing, or nobody knows

    shared::FrameConstants constantsFor(const particles::Exposure& exposure) const;
    particles::CellList cellsIn(const particles::Exposure& exposure) const;
    double dropWay(const particles::Exposure& exposure) const;
    std::vector<SceneLight> seenLamps(const particles::Exposure& exposure) const;
    void leaveOutLamps();
    void setLamps(const particles::Exposure& exposure);
    void setTables(const particles::Exposure& exposure);
    void setDepth(FrameNumber frame, const particles::Exposure& exposure, ConstImageViewF plate, bool isSamePlate);
    /// The frame without its margins.
    ConstImageViewF frameIn(const ImageF& wide) const
    {
        return {wide.pixel(shot.marginX, shot.marginY), shot.width, shot.height, wide.channels(),
                std::ptrdiff_t(wide.width()) * wide.channels()};
    }
    void repair(io::PlateFrame& plate);
    void add(const DrawnPicture& drawn, const Handed& handed);
    ImageF sampledPlate(const io::PlateFrame& plate) const;
    void openRenderer(const CompositorOptions& options);
    std::vector<io::Layer> layersOf(DrawnPicture& drawn) const;
};

shared::FrameConstants Compositor::Impl::constantsFor(const particles::Exposure& exposure) const
{
    shared::FrameConstants c{};
    const auto cameraFromWorld = [](const camera::Pose& pose) {
        return glm::mat4(glm::mat3(glm::transpose(pose.worldFromCamera)));
    };
    c.cameraFromWorldOpen = cameraFromWorld(exposure.poseAtOpen);
    c.cameraFromWorldClose = cameraFromWorld(exposure.poseAtClose);
    const double focal = exposure.projection.focal_px;
    const int width = exposure.projection.width, height = exposure.projection.height;
    c.lens = {float(focal), float(projectionAt(exposure.poseAtClose).focal_px), 0.5f * float(width),
              0.5f * float(height)};
    c.range = {float(settings.near_m), float(settings.far_m), 0, float(settings.opacity)};
    const double lensFocal_m = 1e-3 * settings.sensorWidth_mm * focal / shot.width;
    c.focus = {float(lensFocal_m / settings.fstop), float(1 / settings.focus_m), float(exposure.duration_s),
               float(fogTableScale)};
    c.picture = {std::uint32_t(width), std::uint32_t(height), 0, 0};
    if (settings.fogColor) {
        const auto& color = *settings.fogColor;
        c.fogColor = {float(color[0]), float(color[1]), float(color[2]), 1};
    }
    c.boost = {float(settings.paper ? 0.7 : settings.backgroundBoost), settings.paper ? 1.0f : 0.0f, 0, 0};
    c.grade = {float(settings.darken), float(settings.desaturate), float(settings.blur_px),
               float(settings.blurDistance_m)};
    c.lights.x = std::uint32_t(lampsInUse);
    if (plan.features.fog) c.medium.x = float(extinctionAround(exposure));
    c.lut = {lut.delta, lut.maximum, float(lut.size), 0};
    if (rain) {
        const particles::Visibility visibility = rain->visibility(exposure);
        c.range.z = float(visibility.threshold);
        c.medium.y = float(visibility.thin);
        c.medium.z = veilTable[2 * tableSize - 2];
        c.medium.w = veilTable[2 * tableSize - 1];
        c.boost.z = float(rain->opticalDepth(settings.fogDistance_m, exposure));
    }
    if (plan.features.fog && settings.fog_1_m) c.boost.z = float(*settings.fog_1_m * settings.fogDistance_m);
    if (plan.features.splashes) rain->describeSplashes(c, exposure, settings);
    c.splashKey.w = std::uint32_t(passes::SplashPass::capacity(width, height));
    return c;
}

particles::CellList Compositor::Impl::cellsIn(const particles::Exposure& exposure) const
{
    particles::Visibility visibility = rain->visibility(exposure);
    visibility.skipsOutOfView = plan.skips.outOfView;
    visibility.skipsFaint = plan.skips.faint;
    if (!farthestDepth) return rain->field().cellsInView(exposure, visibility);
    const shared::FrameConstants c = constantsFor(exposure);
    const auto [least, greatest] = std::minmax(c.lens.x, c.lens.y);
    const particles::HiddenCells hidden(*farthestDepth, {.leastFocal_px = double(least),
                                                         .greatestFocal_px = double(greatest),
                                                         .axisX_px = double(c.lens.z),
                                                         .axisY_px = double(c.lens.w),
                                                         .aperture_m = double(c.focus.x),
                                                         .inverseFocus_1_m = double(c.focus.y),
                                                         .near_m = settings.near_m,
                                                         .matteWidthDiameters = matteWidthDiameters});
    visibility.hidden = &hidden;
    return rain->field().cellsInView(exposure, visibility);
}

/// The farthest that a drop gets while the shutter is open [m], the camera's own way left out.
double Compositor::Impl::dropWay(const particles::Exposure& exposure) const
{
    const particles::Motion& motion = rain->field().motion();
    double farthest = 0;
    for (const rainfall::SizeClass& c : rain->field().classes())
        farthest = std::max(farthest, glm::length(motion.displacement(c.speed, exposure.open_s + exposure.duration_s) -
                                                  motion.displacement(c.speed, exposure.open_s)));
    return farthest + 2 * motion.turbulenceReach();
}

std::vector<SceneLight> Compositor::Impl::seenLamps(const particles::Exposure& exposure) const
{
    if (!plan.skips.farLamps) return lamps;
    return lampsInReach(lamps, exposure, settings.far_m, extinctionAround(exposure), greatestTransfer,
                        dropWay(exposure));
}

/// Lamps that no drop of the shot is lit by need no sums and no part in the shaders. A camera that moves may come near
/// them: then each frame decides.
void Compositor::Impl::leaveOutLamps()
{
    ringTransfer = ringTransferTable();
    greatestTransfer = double(*std::max_element(ringTransfer.begin(), ringTransfer.end()));
    if (lamps.empty() || !plan.skips.passes || !track.isStatic()) return;
    if (!seenLamps(exposureAt(shot.firstFrame)).empty()) return;
    plan.features.lights = false;
    plan.leaveOut("lights", fmt::format("no light of '{}' reaches a drop", settings.lights));
}

void Compositor::Impl::setLamps(const particles::Exposure& exposure)
{
    std::vector<shared::PointLight> fromCamera;
    for (const SceneLight& lamp : seenLamps(exposure))
        fromCamera.push_back({glm::vec4(glm::vec3(lamp.position - exposure.poseAtOpen.position), float(lamp.radius_m)),
                              glm::vec4(glm::vec3(lamp.intensity), 0.0f)});
    lampsInUse = fromCamera.size();
    renderer->setLamps(fromCamera);
}

/// Fog and veil as functions of depth. The veil's second sum has the light that the fog in front of it lets through.
void Compositor::Impl::setTables(const particles::Exposure& exposure)
{
    if (tablesFocal == exposure.projection.focal_px) return;
    tablesFocal = exposure.projection.focal_px;
    const particles::Visibility visibility = rain ? rain->visibility(exposure) : particles::Visibility{};
    fogTable.assign(tableSize, 0);
    veilTable.assign(2 * tableSize, 0);
    parallelFor(0, std::ptrdiff_t(tableSize), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto i = std::size_t(first); i < std::size_t(last); ++i) {
            if (plan.features.fog) fogTable[i] = float(fogOpticalDepth(depthOfEntry(i), exposure));
            if (plan.features.veil) veilTable[2 * i] = float(rain->veil(depthOfEntry(i), exposure, visibility));
        }
    });
    for (std::size_t i = 1; i < tableSize; ++i) {
        const float clear = 0.5f * (std::exp(-fogTable[i - 1]) + std::exp(-fogTable[i]));
        veilTable[2 * i + 1] = veilTable[2 * i - 1] + clear * (veilTable[2 * i] - veilTable[2 * i - 2]);
    }
    if (plan.features.fog) {
        statistics.fogExtinction_1_m = extinctionAround(exposure);
        renderer->setFogTable(fogTable);
    }
    if (plan.features.veil) renderer->setVeilTable(veilTable);
}

void Compositor::Impl::setDepth(FrameNumber frame, const particles::Exposure& exposure, ConstImageViewF plate,
                                bool isSamePlate)
{
    const auto now = depth->at(frame, exposure.poseAtOpen, exposure.projection, plate, isSamePlate);
    if (now == usedDepth) return;
    renderer->setDepth(now->metres);
    if (plan.features.rain && plan.skips.behindDepth) farthestDepth.emplace(now->metres);
    statistics.depthCounts = now->counts;
    statistics.depthResampled = now->resampled;
    usedDepth = now;
}

void Compositor::Impl::repair(io::PlateFrame& plate)
{
    if (plate.rows)
        plate.rows = std::make_shared<RepairedRows>(std::move(plate.rows), repairedInRows);
    else
        statistics.repairedPixels += repairPixels(plate.pixels);
}

/// What is known of a picture once it is drawn. Its passes go on the timeline one after the other from when they were
/// handed over, or from the end of the ones before: how long they took is measured, when they began is not.
void Compositor::Impl::add(const DrawnPicture& drawn, const Handed& handed)
{
    for (const auto& [name, ms] : drawn.passMs) statistics.passMs[name] += ms;
    statistics.strokes += drawn.strokes;
    statistics.splashes += drawn.splashes;
    if (timeline == nullptr) return;
    passesEnd = std::max(passesEnd, handed.start);
    for (const char* pass : {"upload", "to light", "light", "blur", "splashes", "drops", "strokes", "composite",
                             "conversion", "to codes", "read-back"}) {
        const auto found = drawn.passMs.find(pass);
        if (found == drawn.passMs.end()) continue;
        const auto end = passesEnd + std::chrono::duration_cast<Timeline::Clock::duration>(
                                         std::chrono::duration<double, std::milli>(found->second));
        timeline->addApart("passes", pass, handed.frame, passesEnd, end);
        passesEnd = end;
    }
}

/// The frame's plate, thinned out for the light.
ImageF Compositor::Impl::sampledPlate(const io::PlateFrame& plate) const
{
    if (plate.rows) return sampledForLight(*plate.rows);
    return sampledForLight(ImageRows(frameIn(plate.pixels)));
}

void Compositor::Impl::openRenderer(const CompositorOptions& options)
{
    const matte::StrokeAtlas atlas = !plan.features.rain       ? matte::StrokeAtlas{}
                                     : settings.mattes.empty() ? builtInAtlas(std::uint32_t(settings.seed))
                                                               : loadAtlas(settings.mattes);
    matteWidthDiameters = double(atlas.acrossDiameters);
    if (plan.features.lights) leaveOutLamps();
    renderer = makePictureRenderer({shot.width + 2 * shot.marginX, shot.height + 2 * shot.marginY, plan.features, atlas,
                                    lut, ringTransfer, options.device, options.shaderFolder, options.cacheFolder});
    statistics.device = renderer->device();
}

Compositor::Compositor(const Settings& settings, const Shot& shot, const CompositorOptions& options,
                       const PlateSamples& samples)
    : options_(options), samples_(samples), impl_(std::make_unique<Impl>(settings, shot, options, samples))
{
    Impl& m = *impl_;
    m.statistics.lightSource = m.lightSource;
    m.timeline = options.timeline;
    if (!m.plan.isPassThrough()) m.openRenderer(options);
}

Compositor::~Compositor() = default;

void Compositor::change(const Settings& settings)
{
    impl_ = std::move(Compositor(settings, impl_->shot, options_, samples_).impl_);
}

Window Compositor::plateNeededFor(const View& view) const { return view.region; }
bool Compositor::needsWholePlate() const { return impl_->light && impl_->light->needsPlate(); }

io::RenderedFrame Compositor::render(io::PlateFrame plate, const View&, const Watch&)
{
    return render(std::move(plate));
}

const FramePlan& Compositor::plan() const { return impl_->plan; }

/// Depth images may have to be fitted to the whole plate.
bool Compositor::takesRows() const
{
    return impl_->renderer && impl_->renderer->takesRows() && impl_->settings.depth.empty();
}

std::size_t Compositor::framesInFlight() const { return impl_->renderer ? impl_->renderer->picturesInFlight() : 0; }

void Compositor::complete()
{
    Impl& m = *impl_;
    const Timer clock;
    const Impl::Handed handed = m.inFlight.front();
    m.inFlight.pop_front();
    const StageSpan span(m.timeline, "renderer", "wait for device", handed.frame);
    m.add(m.renderer->complete(), handed);
    m.statistics.renderSeconds += clock.seconds();
}

const CompositorStatistics& Compositor::statistics() const { return impl_->statistics; }

double Compositor::expectedStrokes() const
{
    const Impl& m = *impl_;
    if (!m.plan.features.rain) return 0;
    const particles::Exposure exposure = m.exposureAt(m.shot.firstFrame);
    return m.rain->field().expectedStrokes(exposure.projection, exposure.duration_s, m.rain->visibility(exposure));
}

bool Compositor::drawsByShaders() const { return impl_->renderer != nullptr && impl_->renderer->isOpenGl(); }

std::vector<io::Layer> Compositor::Impl::layersOf(DrawnPicture& drawn) const
{
    std::vector<io::Layer> layers;
    const auto add = [&](const char* name, ImageF& image) {
        layers.push_back({name,
                          {"R", "G", "B", "A"},
                          image.empty() ? ImageF(drawn.beauty.width(), drawn.beauty.height(), 4) : std::move(image)});
    };
    add("rain", drawn.rain);
    add("splash", drawn.splash);
    add("fog", drawn.fog);
    add("plate", drawn.plate);
    if (plan.features.nearest) {
        layers.push_back({"rain", {"Z"}, std::move(drawn.nearestDepth), true});
        layers.push_back({"rain.motion", {"x", "y"}, std::move(drawn.nearestMotion), true});
    }
    return layers;
}

io::RenderedFrame Compositor::render(io::PlateFrame plate, std::shared_ptr<RowSink> canvas)
{
    Impl& m = *impl_;
    CompositorStatistics& statistics = m.statistics;
    const Timer clock;
    io::RenderedFrame out;
    out.number = plate.number;
    out.extras = plate.extras;
    ++statistics.frames;
    if (m.plan.isPassThrough()) {
        out.beauty = std::move(plate.pixels);
        out.isPlate = true;
        return out;
    }

    const passes::Features& features = m.plan.features;
    const auto timed = [&](const char* name, auto&& work) {
        const StageSpan span(m.timeline, "renderer", name, plate.number);
        const Timer timer;
        work();
        statistics.passMs[name] += timer.milliseconds();
    };
    const particles::Exposure exposure = m.exposureAt(plate.number);
    // Until this frame is through nothing is known of the one before the next.
    const std::uint64_t before = std::exchange(m.lastContent, 0);
    const bool isSamePlate = m.plan.skips.unchanged && plate.content != 0 && plate.content == before;
    timed("inputs", [&] {
        m.repair(plate);
        if (features.depth) m.setDepth(plate.number, exposure, m.frameIn(plate.pixels), isSamePlate);
        m.setTables(exposure);
        if (features.lights) m.setLamps(exposure);
    });
    particles::CellList cells;
    if (features.rain) timed("cells", [&] { cells = m.cellsIn(exposure); });
    if (m.light)
        timed("environment", [&] {
            const ImageF sampled = m.light->needsPlate() ? m.sampledPlate(plate) : ImageF();
            m.repairedInRows = 0;  // they will be read again
            if (m.light->update(plate.number, m.viewOf(sampled, plate.number), isSamePlate))
                m.renderer->setDropRadiance(m.light->radiance(), m.light->lowPassBackground());
            statistics.lightOrder = m.light->order();
            statistics.lightRemainder = m.light->remainder();
            statistics.lightCount = m.light->lightCount();
        });
    if (isSamePlate) m.renderer->keepPlate();
    const glm::mat3 environmentFromWorld(m.light ? m.light->environmentFromWorld() : glm::dmat3(1.0));
    out.canvas = canvas;
    const Impl::Handed handed{plate.number, Timeline::Clock::now()};
    const bool isInFlight = canvas && m.renderer->picturesInFlight() > 0;
    DrawnPicture drawn = [&] {
        const StageSpan span(m.timeline, "renderer", "draw", plate.number);
        return m.renderer->render({std::move(plate.pixels), std::move(plate.rows), std::move(canvas)},
                                  m.constantsFor(exposure), cells, environmentFromWorld);
    }();
    statistics.repairedPixels += m.repairedInRows.exchange(0);
    if (isInFlight)
        m.inFlight.push_back(handed);
    else
        m.add(drawn, handed);
    const std::size_t depthBytes = (m.usedDepth ? m.usedDepth->metres.size() * sizeof(float) : 0) +
                                   (m.farthestDepth ? m.farthestDepth->bytes() : 0);
    statistics.rendererBytes = std::max(statistics.rendererBytes,
                                        m.renderer->bytes() + depthBytes + cells.cells.size() * sizeof(shared::Cell));
    statistics.hiddenCells += cells.hiddenCells;
    statistics.samePlates += isSamePlate ? 1 : 0;
    statistics.lampsLeftOut += m.lamps.size() - m.lampsInUse;
    if (m.wanted.layers && features.layers) out.layers = m.layersOf(drawn);
    m.lastContent = plate.content;
    out.beauty = std::move(drawn.beauty);
    statistics.renderSeconds += clock.seconds();
    return out;
}

}  // namespace virga::shot
