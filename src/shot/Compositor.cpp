#include "shot/Compositor.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <utility>

#include "core/Timer.h"
#include "shot/PixelRepair.h"
#include "shot/ScenePictures.h"

namespace virga::shot {

struct Compositor::Impl : ScenePictures {
    Impl(const Settings& settings_, const Shot& shot_, const CompositorOptions& options_, const PlateSamples& samples_)
        : ScenePictures(settings_, shot_, options_, samples_)
    {
        if (options.changes) samples = samples_;
    }

    PlateSamples samples;  // options.changes
    std::atomic<std::size_t> repairedInRows = 0;

    struct Handed {
        FrameNumber frame;
        Timeline::Clock::time_point start;
    };
    std::deque<Handed> inFlight;              // frames that are not complete, oldest first
    Timeline::Clock::time_point passesEnd{};  // of the passes on the timeline

    void repair(io::PlateFrame& plate);
    void add(const DrawnPicture& drawn, const Handed& handed);
    std::vector<io::Layer> layersOf(DrawnPicture& drawn) const;
    io::RenderedFrame render(io::PlateFrame plate, ViewWindows windows, double later, std::shared_ptr<RowSink> canvas,
                             const Watch& watch);
};

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
    Timeline* const timeline = options.timeline;
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

Compositor::Compositor(const Settings& settings, const Shot& shot, const CompositorOptions& options,
                       const PlateSamples& samples)
    : impl_(std::make_unique<Impl>(settings, shot, options, samples))
{
    impl_->prepare(~0u);
}

Compositor::~Compositor() = default;

void Compositor::change(const Settings& settings)
{
    Impl& m = *impl_;
    if (!m.options.changes) throw Error(ErrorCode::Internal, "this compositor was not made to be changed");
    const SceneParts before = m;
    const auto atlas = m.atlas;
    try {
        m.prepare(m.change(settings, m.samples));
    } catch (...) {
        static_cast<SceneParts&>(m) = before;
        m.atlas = atlas;
        m.forgetWhatIsTold();
        throw;
    }
}

Window Compositor::plateNeededFor(const View& view) const
{
    View anyPlate = view;
    anyPlate.plate = {};
    return impl_->windowsFor(anyPlate).needed;
}

bool Compositor::needsWholePlate() const { return impl_->needsWholePlate(); }

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
    const StageSpan span(m.options.timeline, "renderer", "wait for device", handed.frame);
    m.add(m.renderer->complete(), handed);
    m.statistics.renderSeconds += clock.seconds();
}

const CompositorStatistics& Compositor::statistics() const { return impl_->statistics; }

double Compositor::expectedStrokes() const
{
    const Impl& m = *impl_;
    if (!m.plan.features.rain) return 0;
    const particles::Exposure exposure = m.exposureAt(double(m.shot.firstFrame));
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
    return impl_->render(std::move(plate), impl_->windowsFor({}), 0, std::move(canvas), {});
}

io::RenderedFrame Compositor::render(io::PlateFrame plate, const View& view, const Watch& watch)
{
    if (plate.rows) {
        plate.pixels = wholePicture(*plate.rows);
        plate.rows = nullptr;
    }
    return impl_->render(std::move(plate), impl_->windowsFor(view), view.later, nullptr, watch);
}

io::RenderedFrame Compositor::Impl::render(io::PlateFrame plate, ViewWindows windows, double later,
                                           std::shared_ptr<RowSink> canvas, const Watch& watch)
{
    const Timer clock;
    io::RenderedFrame out;
    out.number = plate.number;
    out.extras = plate.extras;
    ++statistics.frames;
    if (plan.isPassThrough()) {
        out.beauty = plate.rows ? ImageF() : placed(std::move(plate.pixels), windows.plate, windows.region);
        out.isPlate = true;
        return out;
    }

    if (!plate.rows && (plate.pixels.width() != windows.plate.width || plate.pixels.height() != windows.plate.height))
        throw Error(ErrorCode::InvalidArgument, "frame {}: the plate is {}x{} pixels, but {}x{} are to be drawn over",
                    plate.number, plate.pixels.width(), plate.pixels.height(), windows.plate.width,
                    windows.plate.height);
    const passes::Features& features = plan.features;
    const auto timed = [&](const char* name, auto&& work) {
        const StageSpan span(options.timeline, "renderer", name, plate.number);
        const Timer timer;
        work();
        statistics.passMs[name] += timer.milliseconds();
    };
    // Until this frame is through nothing is known of the one before the next.
    const std::uint64_t before = std::exchange(lastContent, 0);
    tell(watch, 0);
    bool isSamePlate = false;
    particles::Exposure exposure;
    timed("inputs", [&] {
        const bool isSameView = look(windows.scale, windows.drawn);
        isSamePlate = isSameView && plan.skips.unchanged && plate.content != 0 && plate.content == before;
        exposure = exposureAt(double(plate.number) + later);
        if (!plate.rows && !needsWholePlate()) {
            plate.pixels = placed(std::move(plate.pixels), windows.plate, drawn);
            windows.plate = drawn;
        }
        repair(plate);
        if (features.depth) setDepth(plate.number, exposure, wholeFrameIn(plate, windows), isSamePlate);
        setTables(exposure);
        if (features.lights) setLamps(exposure);
    });
    tell(watch, 0.1);
    particles::CellList cells;
    if (features.rain)
        timed("cells",
              [&] { cells = cellsIn(exposure, farthestDepth ? &*farthestDepth : nullptr, atlas->acrossDiameters); });
    tell(watch, 0.2);
    if (features.light())
        timed("environment", [&] {
            setLight(plate, windows, isSamePlate);
            repairedInRows = 0;  // rows that the light was taken from will be read again
        });
    tell(watch, 0.3);
    if (isSamePlate) renderer->keepPlate();
    const glm::mat3 environmentFromWorld(light ? light->environmentFromWorld() : glm::dmat3(1.0));
    out.canvas = canvas;
    const Handed handed{plate.number, Timeline::Clock::now()};
    const bool isInFlight = canvas && renderer->picturesInFlight() > 0;
    DrawnPicture picture = [&] {
        const StageSpan span(options.timeline, "renderer", "draw", plate.number);
        return renderer->render({placed(std::move(plate.pixels), windows.plate, plate.rows ? windows.plate : drawn),
                                 std::move(plate.rows), std::move(canvas)},
                                constantsFor(exposure, tables, lampsInUse), cells, environmentFromWorld,
                                watch ? [&](double done) { return watch(0.3 + 0.7 * done); } : Watch());
    }();
    statistics.repairedPixels += repairedInRows.exchange(0);
    if (isInFlight)
        inFlight.push_back(handed);
    else
        add(picture, handed);
    const std::size_t depthBytes =
        (usedDepth ? usedDepth->metres.size() * sizeof(float) : 0) + (farthestDepth ? farthestDepth->bytes() : 0);
    statistics.rendererBytes =
        std::max(statistics.rendererBytes, renderer->bytes() + depthBytes + cells.cells.size() * sizeof(shared::Cell));
    statistics.hiddenCells += cells.hiddenCells;
    statistics.samePlates += isSamePlate ? 1 : 0;
    statistics.lampsLeftOut += lamps.size() - lampsInUse;
    if (options.wanted.layers && features.layers) {
        out.layers = layersOf(picture);
        for (io::Layer& layer : out.layers) layer.pixels = placed(std::move(layer.pixels), drawn, windows.region);
    }
    lastContent = plate.content;
    out.beauty = std::move(picture.beauty);
    if (!out.beauty.empty()) out.beauty = placed(std::move(out.beauty), drawn, windows.region);
    statistics.renderSeconds += clock.seconds();
    tell(watch, 1);
    return out;
}

}  // namespace virga::shot
