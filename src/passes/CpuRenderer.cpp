#include "passes/CpuRenderer.h"

#include <algorithm>
#include <cassert>
#include <glm/packing.hpp>
#include <limits>
#include <mutex>

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
    double strokes = 0, splashes = 0, composite = 0;
    double all() const { return strokes + splashes + composite; }
    void add(const BandTimes& other)
    {
        strokes += other.strokes;
        splashes += other.splashes;
        composite += other.composite;
    }
};

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

    int bands() const { return (frame.height() + bandRows - 1) / bandRows; }
    void makeLayers();
    void emit(const particles::CellList& cells);
    void emitAllSplashes();
    void drawBands(ImageView<float> picture);
    void drawBand(int number, BandSums& band, ImageView<float> picture, BandTimes& times);
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
void CpuRenderer::Impl::drawBands(ImageView<float> picture)
{
    const Timer timer;
    std::mutex mutex;
    BandTimes all;
    parallelFor(0, bands(), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        BandSums band;
        BandTimes times;
        for (auto number = int(first); number < int(last); ++number) drawBand(number, band, picture, times);
        const std::lock_guard lock(mutex);
        all.add(times);
    });
    const double share = timer.milliseconds() / std::max(all.all(), 1e-6);
    if (frame.features.rain) passMs["strokes"] += share * all.strokes;
    if (frame.features.splashes) passMs["splashes"] += share * all.splashes;
    passMs["composite"] += share * all.composite;
}

void CpuRenderer::Impl::drawBand(int number, BandSums& band, ImageView<float> picture, BandTimes& times)
{
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
    compositeBand(frame, band, picture, layers);
    take(times.composite);
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

void CpuRenderer::render(ImageView<float> picture, const shared::FrameConstants& constants,
                         const particles::CellList& cells, const glm::mat3& environmentFromWorld)
{
    Impl& m = *impl_;
    assert(picture.width() == int(constants.picture.x) && picture.height() == int(constants.picture.y));
    m.frame.constants = constants;
    const Features& f = m.frame.features;
    const auto timed = [&](const char* name, auto&& work) {
        const Timer timer;
        work();
        m.passMs[name] += timer.milliseconds();
    };
    m.passMs.clear();
    m.makeLayers();
    if (f.light()) {
        m.frame.constants.lights.y = std::uint32_t(lightGridStep(m.radiance.width(), constants.lens.x));
        timed("light", [&] { fillLightGrid(m.frame, m.radiance, m.lowPass, environmentFromWorld); });
    }
    m.strokes = 0;
    if (f.rain) timed("drops", [&] { m.emit(cells); });
    if (f.splashes) timed("splashes", [&] { m.emitAllSplashes(); });
    if (f.blur)
        timed("blur", [&] {
            if (f.darken || f.colorTransfer)
                parallelFor(0, picture.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
                    for (auto y = int(first); y < int(last); ++y) gradeRow(m.frame, picture.row(y), picture.width());
                });
            blurPicture(m.frame, picture);
        });
    m.drawBands(picture);
}

std::size_t CpuRenderer::strokeCount() const { return impl_->strokes; }
std::size_t CpuRenderer::splashCount() const { return impl_->splashes; }
const std::map<std::string, double>& CpuRenderer::passMs() const { return impl_->passMs; }
ImageF CpuRenderer::takeRain() { return std::move(impl_->layers.rain); }
ImageF CpuRenderer::takeSplash() { return std::move(impl_->layers.splash); }
ImageF CpuRenderer::takeFog() { return std::move(impl_->layers.fog); }
ImageF CpuRenderer::takePlate() { return std::move(impl_->layers.plate); }
ImageF CpuRenderer::takeNearestDepth() { return std::move(impl_->nearestDepth); }
ImageF CpuRenderer::takeNearestMotion() { return std::move(impl_->nearestMotion); }

}  // namespace virga::passes
