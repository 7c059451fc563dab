#include "passes/CpuComposite.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/Lanes.h"
#include "core/Parallel.h"
#include "passes/CpuGrade.h"
#include "passes/CpuLamps.h"
#include "sh/Panorama.h"

namespace virga::passes::cpu {
namespace {

using lanes::Float;

/// One pixel, RGBA.
typedef float Pixel __attribute__((vector_size(16)));

VIRGA_INLINE Pixel loadPixel(const float* p)
{
    Pixel result;
    std::memcpy(&result, p, sizeof result);
    return result;
}
VIRGA_INLINE void storePixel(const Pixel& pixel, float* p) { std::memcpy(p, &pixel, sizeof pixel); }
VIRGA_INLINE Pixel withAlpha(const Pixel& light, float alpha)
{
    return Pixel{light[0], light[1], light[2], 1.0f} * alpha;
}

/// A row of a light grid at the height of one row of pixels.
void interpolateRow(const ImageF& grid, float at, std::vector<float>& row)
{
    const int top = std::min(int(at), grid.height() - 1), bottom = std::min(top + 1, grid.height() - 1);
    const float t = at - float(top);
    row.resize(std::size_t(grid.width() + 1) * 4);
    for (int i = 0; i < 4 * grid.width(); ++i)
        row[std::size_t(i)] = grid.row(top)[i] + (grid.row(bottom)[i] - grid.row(top)[i]) * t;
    std::copy_n(row.end() - 8, 4, row.end() - 4);  // held beyond the last node
}

VIRGA_INLINE Pixel between(const std::vector<float>& row, std::size_t node, float t)
{
    const Pixel left = loadPixel(row.data() + 4 * node), right = loadPixel(row.data() + 4 * node + 4);
    return left + (right - left) * t;
}

/// What eight pixels have of fog and rain.
struct Coverage {
    struct Drops {
        float alpha[lanes::count], clear[lanes::count];  // and the share of their light that the fog lets through
        float lamps[3][lanes::count];
    };
    float fogAlpha[lanes::count], glow[3][lanes::count];
    Drops rain, splash;
    bool isAny = false;
};

/// What the strokes that are thinned out would have added to eight pixels, in steps.
struct Veil {
    float sums[lanes::count] = {}, weighted[lanes::count] = {};
};
VIRGA_INLINE Veil veilOver(const Frame& frame, int x, int y, int pixels)
{
    Veil veil;
    for (int i = 0; i < pixels; ++i) {
        const glm::vec2 pair = frame.features.depth ? frame.veilTo(frame.depth.row(y)[x + i])
                                                    : glm::vec2(frame.constants.medium.z, frame.constants.medium.w);
        veil.sums[i] = pair.x * opticalDepthSteps;
        veil.weighted[i] = pair.y * opticalDepthSteps;
    }
    return veil;
}

/// False, and alpha 0, where there are none. `all`: sums of the band's pixels.
VIRGA_INLINE bool readSums(const Frame& frame, const BandSums& band, const std::vector<std::uint32_t>& all,
                           bool hasVeil, int x, int y, int pixels, Coverage::Drops& out)
{
    const Features& f = frame.features;
    float depths[lanes::count] = {}, weighted[lanes::count] = {}, lamps[3][lanes::count] = {};
    const std::uint32_t* sums =
        all.data() +
        (std::size_t(y - band.firstRow) * std::size_t(frame.width()) + std::size_t(x)) * std::size_t(band.perPixel);
    std::uint32_t any = 0;
    for (int i = 0; i < pixels; ++i, sums += band.perPixel) {
        any |= sums[0];
        depths[i] = float(sums[0]);
        if (f.fog) weighted[i] = float(sums[1]);
        if (f.lights)
            for (int k = 0; k < 3; ++k) lamps[k][i] = float(sums[frame.lampSums() + k]);
    }
    if (hasVeil) {
        const Veil veil = veilOver(frame, x, y, pixels);
        for (int i = 0; i < lanes::count; ++i) {
            depths[i] += veil.sums[i];
            weighted[i] += veil.weighted[i];
            any |= veil.sums[i] > 0 ? 1u : 0u;
        }
    }
    if (any == 0) {
        std::fill_n(out.alpha, lanes::count, 0.0f);
        return false;
    }
    const Float depth = lanes::load(depths);
    lanes::store(Float(1.0f) - lanes::exp(depth * (-1.0f / opticalDepthSteps)), out.alpha);
    const Float whole = lanes::max(depth, 1.0f);
    lanes::store(lanes::load(weighted) / whole, out.clear);
    if (f.lights)
        for (int k = 0; k < 3; ++k) lanes::store(lanes::load(lamps[k]) / whole, out.lamps[k]);
    return true;
}

VIRGA_INLINE void readFog(const Frame& frame, int x, int y, int pixels, Coverage& out)
{
    float optical[lanes::count] = {};
    const float* depth = frame.depth.row(y) + x;
    for (int i = 0; i < pixels; ++i) optical[i] = frame.fogTo(depth[i]);
    lanes::store(Float(1.0f) - lanes::exp(-lanes::load(optical)), out.fogAlpha);
    out.isAny = true;
}

}  // namespace

VIRGA_SIMD void compositeRows(const Frame& frame, const BandSums& band, int firstRow, ImageView<float> rows,
                              LayerImages& layers)
{
    const shared::FrameConstants& c = frame.constants;
    const Features& f = frame.features;
    const float step = float(c.lights.y), fixedFog = c.fogColor.w;
    const Pixel fogColor = {c.fogColor.x, c.fogColor.y, c.fogColor.z, 0};
    const bool isGraded = (f.darken || f.colorTransfer) && !f.blur;  // the blur grades what it reads
    std::vector<float> light, behind;
    Coverage coverage;
    if (f.fog && !f.depth) std::fill_n(coverage.fogAlpha, lanes::count, 1.0f - std::exp(-c.boost.z));
    if (!f.fog) std::fill_n(coverage.fogAlpha, lanes::count, 0.0f);
    std::fill_n(coverage.rain.alpha, lanes::count, 0.0f);
    std::fill_n(coverage.splash.alpha, lanes::count, 0.0f);
    const bool isFogEverywhere = f.fog && (f.depth || f.lights || coverage.fogAlpha[0] > 0);

    for (int y = firstRow; y < firstRow + rows.height(); ++y) {
        if (f.light()) interpolateRow(frame.lightGrid, (float(y) + 0.5f) / step, light);
        if (f.lowPass() && f.light()) interpolateRow(frame.lowPassGrid, (float(y) + 0.5f) / step, behind);
        float* row = rows.row(y - firstRow);
        if (isGraded) gradeRow(frame, row, rows.width());
        for (int x = 0; x < rows.width(); x += lanes::count) {
            const int pixels = std::min(lanes::count, rows.width() - x);
            coverage.isAny = isFogEverywhere;
            if (f.rain && readSums(frame, band, band.sums, f.veil, x, y, pixels, coverage.rain)) coverage.isAny = true;
            if (f.splashes && readSums(frame, band, band.splashSums, false, x, y, pixels, coverage.splash))
                coverage.isAny = true;
            if (f.fog && f.depth) readFog(frame, x, y, pixels, coverage);
            if (f.fog && f.lights) glowAroundLamps(frame, x, y, pixels, coverage.glow);
            if (!coverage.isAny && !f.layers) continue;
            for (int i = 0; i < pixels; ++i) {
                const Pixel background = loadPixel(row + 4 * (x + i));
                Pixel result = background, fog{}, splash{}, rain{};
                if (coverage.isAny) {
                    const float at = (float(x + i) + 0.5f) / step;
                    const auto node = std::size_t(at);
                    const float t = at - float(node);
                    const Pixel drop = between(light, node, t);
                    Pixel lit = drop, low{};
                    if (f.lowPass()) low = between(behind, node, t);
                    if (f.boost) {
                        const Pixel detail = c.boost.y == 0 ? background - low : background;
                        lit = drop + detail * c.boost.x;
                        lit = lit > 0.0f ? lit : Pixel{};
                    }
                    // Half of what a large drop takes out of a beam is diffracted straight on (Babinet). The paper's
                    // mode leaves its maps as they ring, below 0 too.
                    const Pixel half = (drop + low) * 0.5f, mean = half > 0.0f ? half : Pixel{};
                    const Pixel fogLight = mean + (fogColor - mean) * fixedFog;
                    if (f.fog) {
                        fog = withAlpha(fogLight, coverage.fogAlpha[i]);
                        if (f.lights) fog += Pixel{coverage.glow[0][i], coverage.glow[1][i], coverage.glow[2][i], 0};
                        result = fog + result * (1.0f - coverage.fogAlpha[i]);
                    }
                    const auto drops = [&](const Coverage::Drops& d) __attribute__((always_inline))
                    {
                        Pixel seen = f.fog ? fogLight + (lit - fogLight) * d.clear[i] : lit;
                        if (f.lights) seen += Pixel{d.lamps[0][i], d.lamps[1][i], d.lamps[2][i], 0};
                        return withAlpha(seen, d.alpha[i]);
                    };
                    if (coverage.splash.alpha[i] > 0) {
                        splash = drops(coverage.splash);
                        result = splash + result * (1.0f - coverage.splash.alpha[i]);
                    }
                    if (coverage.rain.alpha[i] > 0) {
                        rain = drops(coverage.rain);
                        result = rain + result * (1.0f - coverage.rain.alpha[i]);
                    }
                }
                storePixel(result, row + 4 * (x + i));
                if (f.layers) {
                    if (f.rain) storePixel(rain, layers.rain.pixel(x + i, y));
                    if (f.splashes) storePixel(splash, layers.splash.pixel(x + i, y));
                    if (f.fog) storePixel(fog, layers.fog.pixel(x + i, y));
                    storePixel(background, layers.plate.pixel(x + i, y));
                }
            }
        }
    }
}

void fillLightGrid(Frame& frame, ConstImageViewF dropRadiance, ConstImageViewF lowPassBackground,
                   const glm::mat3& environmentFromWorld)
{
    const shared::FrameConstants& c = frame.constants;
    const float step = float(c.lights.y);
    const int columns = frame.width() / int(c.lights.y) + 2, rows = frame.height() / int(c.lights.y) + 2;
    const auto fit = [&](ImageF& grid) {
        if (grid.width() != columns || grid.height() != rows) grid = ImageF(columns, rows, 4);
    };
    fit(frame.lightGrid);
    if (frame.features.lowPass()) fit(frame.lowPassGrid);
    const glm::mat3 environmentFromCamera = environmentFromWorld * glm::transpose(glm::mat3(c.cameraFromWorldOpen));
    parallelFor(0, rows, 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto y = int(first); y < int(last); ++y)
            for (int x = 0; x < columns; ++x) {
                const glm::vec3 ray((float(x) * step - c.lens.z) / c.lens.x, -(float(y) * step - c.lens.w) / c.lens.x,
                                    -1.0f);
                const glm::dvec3 direction(environmentFromCamera * ray);
                const auto put = [&](ConstImageViewF map, ImageF& grid) {
                    const glm::dvec3 value = sh::sampleMap(map, direction);
                    for (int k = 0; k < 3; ++k) grid.at(x, y, k) = float(value[k]);
                };
                put(dropRadiance, frame.lightGrid);
                if (frame.features.lowPass()) put(lowPassBackground, frame.lowPassGrid);
            }
    });
}

}  // namespace virga::passes::cpu
