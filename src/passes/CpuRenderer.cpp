#include "passes/CpuRenderer.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <glm/packing.hpp>
#include <limits>
#include <mutex>
#include <thread>

#include "core/Parallel.h"
#include "core/Timer.h"
#include "passes/CpuBlur.h"
#include "passes/CpuComposite.h"
#include "passes/CpuDrops.h"
#include "passes/CpuGrade.h"
#include "passes/CpuSmallStrokes.h"
#include "passes/CpuSplashes.h"
#include "passes/CpuStrokes.h"
#include "passes/LightGrid.h"
#include "passes/StrokeMattes.h"

namespace virga::passes {

using namespace cpu;

namespace {

/// What a thread spends on its bands [ms].
struct BandTimes {
    double strokes = 0, splashes = 0, composite = 0, conversion = 0;
    double all() const { return strokes + splashes + composite + conversion; }
    void add(const BandTimes& other)
    {
        strokes += other.strokes;
        splashes += other.splashes;
        composite += other.composite;
        conversion += other.conversion;
    }
};

/// What a thread has for its bands.
struct BandWork {
    BandSums sums;
    std::vector<float> light;  // rows between codes and codes
    BandTimes times;
};

/// Where the plate comes from and where the result goes.
struct Surface {
    ImageView<float> picture;  // drawn over where it lies, unless there are rows
    const RowSource* plate = nullptr;
    RowSink* result = nullptr;
};

/// Rows of light between codes and codes: 245 kB at 1080p, beside the sums of a band.
constexpr int rowsAtOnce = 2 * rowsPerChroma;
static_assert(bandRows % rowsAtOnce == 0);

/// A list for each piece of [0, count): fill(first, last, list). Returns how many things are in all of them.
template <class List, class Fill>
std::size_t fillLists(std::vector<List>& lists, int bands, std::size_t count, std::size_t perPiece, Fill&& fill)
{
    lists.resize((count + perPiece - 1) / perPiece);
    parallelFor(0, std::ptrdiff_t(lists.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto piece = std::size_t(first); piece < std::size_t(last); ++piece) {
            lists[piece].clear(bands);
            fill(piece * perPiece, std::min((piece + 1) * perPiece, count), lists[piece]);
        }
    });
    std::size_t all = 0;
    for (const List& list : lists) all += list.items.size();
    return all;
}

}  // namespace

struct CpuRenderer::Impl {
    cpu::Frame frame;
    ImageF radiance, lowPass;
    std::vector<StrokeList> lists;  // one for each piece of the cells; kept, so that their memory is
    std::vector<SplashList> splashLists;
    std::size_t strokes = 0, splashes = 0;
    std::map<std::string, double> passMs;
    LayerImages layers;
    ImageF nearestDepth, nearestMotion;
    Watch watch;

    template <class Work>
    void timed(const char* name, const Work& work)
    {
        const Timer timer;
        work();
        passMs[name] += timer.milliseconds();
    }
    int bands() const { return (frame.height() + bandRows - 1) / bandRows; }
    void makeLayers();
    void emit(const particles::CellList& cells);
    void emitAllSplashes();
    void begin(const shared::FrameConstants& constants, const particles::CellList& cells,
               const glm::mat3& environmentFromWorld);
    void drawBands(const Surface& surface);
    void drawBand(int number, const Surface& surface, BandWork& work);
    void compositeCodes(const Surface& surface, BandWork& work);
    void keepNearest(const BandSums& band);
};

CpuRenderer::CpuRenderer(int width, int height, const Features& features, const matte::StrokeAtlas& atlas)
    : impl_(std::make_unique<Impl>())
{
    cpu::Frame& frame = impl_->frame;
    frame.features = features;
    frame.constants.picture = {width, height, 0, 0};
    if (!features.rain) return;
    frame.mattes = {atlas.width,           atlas.height,          atlas.groups,          atlas.variants,
                    atlas.firstBeadCycles, atlas.groupsPerOctave, atlas.acrossDiameters, normalisedPrefix(atlas),
                    rowDensities(atlas)};
}

CpuRenderer::~CpuRenderer() = default;

void CpuRenderer::resize(int width, int height) { impl_->frame.constants.picture = {width, height, 0, 0}; }
void CpuRenderer::setWatch(const Watch& watch) { impl_->watch = watch; }

void CpuRenderer::setDepth(ConstImageViewF depth) { impl_->frame.depth = depth; }
void CpuRenderer::setFogTable(const std::vector<float>& opticalDepth) { impl_->frame.fogTable = opticalDepth; }

void CpuRenderer::setVeilTable(const std::vector<float>& sums) { impl_->frame.veilTable = sums; }

void CpuRenderer::setLamps(std::span<const shared::PointLight> lamps)
{
    impl_->frame.lamps.assign(lamps.begin(), lamps.end());
}

void CpuRenderer::setRingTransfer(const std::vector<float>& ringTransfer) { impl_->frame.ringTransfer = ringTransfer; }
void CpuRenderer::setLut(const std::vector<float>& rgb) { impl_->frame.lut = rgb; }

void CpuRenderer::setDropRadiance(ConstImageViewF radiance, ConstImageViewF lowPassBackground)
{
    const auto copy = [](ConstImageViewF map) {
        ImageF image(map.width(), map.height(), map.channels());
        for (int y = 0; y < map.height(); ++y)
            std::copy_n(map.row(y), std::size_t(map.width()) * std::size_t(map.channels()), image.row(y));
        return image;
    };
    impl_->radiance = copy(radiance);
    if (impl_->frame.features.lowPass()) impl_->lowPass = copy(lowPassBackground);
}

void CpuRenderer::Impl::makeLayers()
{
    const Features& f = frame.features;
    const auto fresh = [&](bool isWanted) { return isWanted ? ImageF(frame.width(), frame.height(), 4) : ImageF(); };
    layers = {fresh(f.layers && f.rain), fresh(f.layers && f.splashes), fresh(f.layers && f.fog), fresh(f.layers)};
    if (!f.nearest) return;
    nearestDepth = ImageF(frame.width(), frame.height(), 1);
    nearestMotion = ImageF(frame.width(), frame.height(), 2);
}

void CpuRenderer::Impl::emit(const particles::CellList& cells)
{
    constexpr std::size_t cellsPerPiece = 1024;
    strokes = fillLists(
        lists, bands(), cells.cells.size(), cellsPerPiece,
        [&](std::size_t first, std::size_t last, StrokeList& list) { emitStrokes(frame, cells, first, last, list); });
}

void CpuRenderer::Impl::emitAllSplashes()
{
    constexpr std::size_t rowsPerPiece = 8;
    const auto rows = std::size_t((frame.height() + splashBlock - 1) / splashBlock);
    splashes =
        fillLists(splashLists, bands(), rows, rowsPerPiece, [&](std::size_t first, std::size_t last, SplashList& list) {
            emitSplashes(frame, int(first), int(last), list);
        });
}

/// Strokes, splashes and composite run in turn within each band. The whole's time is shared among them as the threads'
/// own times are.
void CpuRenderer::Impl::drawBands(const Surface& surface)
{
    const Timer timer;
    std::mutex mutex;
    BandTimes all;
    const auto caller = std::this_thread::get_id();
    std::atomic<int> done = 0;
    std::atomic<bool> ends = false;
    parallelFor(0, bands(), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        BandWork work;
        for (auto number = int(first); number < int(last) && !ends; ++number) {
            drawBand(number, surface, work);
            const int drawn = ++done;
            if (watch && std::this_thread::get_id() == caller && !watch(double(drawn) / bands())) ends = true;
        }
        const std::lock_guard lock(mutex);
        all.add(work.times);
    });
    if (ends) throw Error(ErrorCode::Interrupted, "the frame is wanted no longer");
    const double share = timer.milliseconds() / std::max(all.all(), 1e-6);
    if (frame.features.rain) passMs["strokes"] += share * all.strokes;
    if (frame.features.splashes) passMs["splashes"] += share * all.splashes;
    passMs["composite"] += share * all.composite;
    if (surface.plate != nullptr) passMs["conversion"] += share * all.conversion;
}

void CpuRenderer::Impl::drawBand(int number, const Surface& surface, BandWork& work)
{
    BandSums& band = work.sums;
    BandTimes& times = work.times;
    Timer timer;
    const auto take = [&](double& time) {
        time += timer.milliseconds();
        timer.restart();
    };
    const Features& f = frame.features;
    band.firstRow = number * bandRows;
    band.lastRow = std::min(band.firstRow + bandRows, frame.height());
    band.perPixel = frame.sumsPerPixel();
    const std::size_t pixels = std::size_t(band.lastRow - band.firstRow) * std::size_t(frame.width());
    if (f.rain) {
        band.sums.assign((pixels + smallStrokeReach) * std::size_t(band.perPixel), 0);
        if (f.nearest) {
            band.nearestDepth.assign(pixels, std::numeric_limits<float>::infinity());
            band.motion.assign(pixels, 0);
        }
        for (const StrokeList& list : lists) {
            splatSmallStrokes(frame, list, std::size_t(number), band);
            splatStrokes(frame, list, std::size_t(number), band);
        }
        if (f.nearest) keepNearest(band);
        take(times.strokes);
    }
    if (f.splashes) {
        band.splashSums.assign(pixels * std::size_t(band.perPixel), 0);
        for (const SplashList& list : splashLists) splatSplashes(frame, list, std::size_t(number), band);
        take(times.splashes);
    }
    if (surface.plate != nullptr) {
        compositeCodes(surface, work);
    } else {
        compositeRows(frame, band, band.firstRow, rowsOf(surface.picture, band.firstRow, band.lastRow), layers);
        take(times.composite);
    }
}

void CpuRenderer::Impl::compositeCodes(const Surface& surface, BandWork& work)
{
    const BandSums& band = work.sums;
    BandTimes& times = work.times;
    work.light.resize(std::size_t(rowsAtOnce) * std::size_t(frame.width()) * 4);
    Timer timer;
    const auto take = [&](double& time) {
        time += timer.milliseconds();
        timer.restart();
    };
    for (int first = band.firstRow; first < band.lastRow; first += rowsAtOnce) {
        const ImageView<float> rows(work.light.data(), frame.width(), std::min(rowsAtOnce, band.lastRow - first), 4);
        surface.plate->read(first, rows);
        take(times.conversion);
        compositeRows(frame, band, first, rows, layers);
        take(times.composite);
        surface.result->write(first, rows);
        take(times.conversion);
    }
}

void CpuRenderer::Impl::keepNearest(const BandSums& band)
{
    std::copy(band.nearestDepth.begin(), band.nearestDepth.end(), nearestDepth.row(band.firstRow));
    float* motion = nearestMotion.row(band.firstRow);
    for (const std::uint32_t packed : band.motion) {
        const glm::vec2 way = glm::unpackHalf2x16(packed);
        *motion++ = way.x;
        *motion++ = way.y;
    }
}

/// Everything before the bands.
void CpuRenderer::Impl::begin(const shared::FrameConstants& constants, const particles::CellList& cells,
                              const glm::mat3& environmentFromWorld)
{
    frame.constants = constants;
    const Features& f = frame.features;
    passMs.clear();
    makeLayers();
    if (f.light()) {
        frame.constants.lights.y = std::uint32_t(lightGridStep(radiance.width(), constants.lens.x));
        timed("light", [&] { fillLightGrid(frame, radiance, lowPass, environmentFromWorld); });
    }
    strokes = 0;
    if (f.rain) timed("drops", [&] { emit(cells); });
    if (f.splashes) timed("splashes", [&] { emitAllSplashes(); });
}

void CpuRenderer::render(ImageView<float> picture, const shared::FrameConstants& constants,
                         const particles::CellList& cells, const glm::mat3& environmentFromWorld)
{
    Impl& m = *impl_;
    assert(picture.width() == int(constants.picture.x) && picture.height() == int(constants.picture.y));
    m.begin(constants, cells, environmentFromWorld);
    const Features& f = m.frame.features;
    if (f.blur)
        m.timed("blur", [&] {
            if (f.darken || f.colorTransfer)
                parallelFor(0, picture.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
                    for (auto y = int(first); y < int(last); ++y) gradeRow(m.frame, picture.row(y), picture.width());
                });
            blurPicture(m.frame, picture);
        });
    m.drawBands({.picture = picture});
}

void CpuRenderer::render(const RowSource& plate, RowSink& result, const shared::FrameConstants& constants,
                         const particles::CellList& cells, const glm::mat3& environmentFromWorld)
{
    Impl& m = *impl_;
    assert(plate.width() == int(constants.picture.x) && plate.height() == int(constants.picture.y));
    assert(!m.frame.features.blur);
    m.begin(constants, cells, environmentFromWorld);
    m.drawBands({.picture = {}, .plate = &plate, .result = &result});
}

std::size_t CpuRenderer::strokeCount() const { return impl_->strokes; }
std::size_t CpuRenderer::splashCount() const { return impl_->splashes; }
const std::map<std::string, double>& CpuRenderer::passMs() const { return impl_->passMs; }
std::size_t CpuRenderer::bytes() const
{
    const Impl& m = *impl_;
    std::size_t all = 0;
    for (const StrokeList& list : m.lists) all += list.bytes() + list.lamps.capacity() * sizeof(glm::vec3);
    for (const SplashList& list : m.splashLists) all += list.bytes();
    std::size_t values = m.frame.mattes.prefix.size() + m.frame.mattes.densities.size() + m.frame.lut.size();
    for (const ImageF* image : {&m.radiance, &m.lowPass, &m.frame.lightGrid, &m.frame.lowPassGrid, &m.layers.rain,
                                &m.layers.splash, &m.layers.fog, &m.layers.plate, &m.nearestDepth, &m.nearestMotion})
        values += image->size();
    const std::size_t sumsOfBand = std::size_t(bandRows) * std::size_t(m.frame.width()) *
                                   std::size_t(m.frame.sumsPerPixel()) * (m.frame.features.splashes ? 2 : 1);
    values += sumsOfBand * std::thread::hardware_concurrency();
    return all + values * sizeof(float);
}

ImageF CpuRenderer::takeRain() { return std::move(impl_->layers.rain); }
ImageF CpuRenderer::takeSplash() { return std::move(impl_->layers.splash); }
ImageF CpuRenderer::takeFog() { return std::move(impl_->layers.fog); }
ImageF CpuRenderer::takePlate() { return std::move(impl_->layers.plate); }
ImageF CpuRenderer::takeNearestDepth() { return std::move(impl_->nearestDepth); }
ImageF CpuRenderer::takeNearestMotion() { return std::move(impl_->nearestMotion); }

}  // namespace virga::passes
