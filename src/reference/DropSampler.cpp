#include "reference/DropSampler.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Parallel.h"
#include "optics/DropOscillation.h"
#include "particles/CellHash.h"

namespace virga::reference {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int clearSteps = 2048;
/// A stroke at least so opaque takes all its samples.
constexpr double plain = 0.01;

/// Point `n` of `count` that fill the unit cube evenly: one coordinate in equal steps, `others` (1 to 4) by powers of a
/// generalised golden ratio. shift: 64 random bits.
std::array<double, 5> latticePoint(std::uint64_t n, std::uint64_t count, int others, std::uint64_t shift)
{
    // Of each number of coordinates d the root of g^(d+1) = g + 1.
    constexpr double ratios[] = {1.6180339887498949, 1.3247179572447460, 1.2207440846057596, 1.1673039782614187};
    const double step = 1 / ratios[others - 1];
    std::array<double, 5> point{};
    double place = double(n) / double(count), way = 1;
    for (int i = 0; i <= others; ++i) {
        const double x = particles::unitDouble(particles::mix(shift + std::uint64_t(i))) + place;
        point[std::size_t(i)] = x - std::floor(x);
        way *= step;
        place = double(n) * way;
    }
    return point;
}

glm::dvec2 onDisc(double a, double b) { return std::sqrt(a) * glm::dvec2(std::cos(2 * pi * b), std::sin(2 * pi * b)); }

/// The moment at share t of the exposure.
DropPath::Moment momentAt(const DropPath& path, double t)
{
    const double place = std::clamp(t, 0.0, 1.0) * (path.moments - 1);
    const int i = std::min(int(place), path.moments - 2);
    const DropPath::Moment &a = path.at[std::size_t(i)], &b = path.at[std::size_t(i + 1)];
    const double f = place - i;
    // Between two moments a drop goes straight in space, and so does its picture, not at an even pace.
    const double depth = glm::mix(a.depth, b.depth, f);
    const double along = f * b.depth / depth;
    return {glm::mix(a.fromCamera, b.fromCamera, f), glm::mix(a.px, b.px, along), depth,
            glm::mix(a.focal_px, b.focal_px, f)};
}

}  // namespace

SamplerTables::SamplerTables(const Scene& scene)
{
    if (const matte::StrokeAtlas* atlas = scene.rain.atlas) {
        for (int n = 0; n < atlas->count(); ++n) {
            double sum = 0;
            for (int y = 0; y < atlas->height; ++y)
                for (int x = 0; x < atlas->width; ++x) sum += double(atlas->layer(n).at(x, y));
            layerMeans.push_back(sum / (double(atlas->width) * atlas->height));
        }
    }
    if (scene.air.opticalDepth) {
        clear.resize(clearSteps + 1);
        parallelFor(0, clearSteps + 1, 32, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (std::ptrdiff_t i = first; i < last; ++i)
                clear[std::size_t(i)] =
                    std::exp(-scene.air.opticalDepth(scene.rain.visibility.far_m * double(i) / clearSteps));
        });
    }
    if (!scene.lamps.empty())
        for (std::size_t c = 0; c < 3; ++c)
            transfer[c].emplace(optics::DropTransferOptions{.index = optics::waterIndex[c]});
}

DropSampler::DropSampler(const Scene& scene, const SamplerTables& tables, ConstImageViewF depth)
    : scene_(scene), tables_(tables), depth_(depth)
{
    const camera::Projection& picture = scene.exposure.projection;
    sums_.resize(std::size_t(picture.width) * std::size_t(picture.height));
}

double DropSampler::clearTo(double depth) const
{
    if (tables_.clear.empty()) return 1;
    const double place = std::clamp(depth / scene_.rain.visibility.far_m, 0.0, 1.0) * clearSteps;
    const auto i = std::min(std::size_t(place), std::size_t(clearSteps - 1));
    return glm::mix(tables_.clear[i], tables_.clear[i + 1], place - double(i));
}

glm::dvec3 DropSampler::lampsIn(const DropPath::Moment& moment, double share) const
{
    const particles::Exposure& exposure = scene_.exposure;
    const glm::dvec3 camera = glm::mix(exposure.poseAtOpen.position, exposure.poseAtClose.position, share);
    const glm::dvec3 view = glm::normalize(moment.fromCamera);
    constexpr double leastHalfWidth = pi / 180 / 8;  // what RingTransfer tells apart
    glm::dvec3 sum(0.0);
    for (const Lamp& lamp : scene_.lamps) {
        const glm::dvec3 way = lamp.position - camera - moment.fromCamera;
        const double distance = std::max(glm::length(way), lamp.radius_m);
        const double theta = std::acos(std::clamp(glm::dot(view, way) / glm::length(way), -1.0, 1.0));
        const double halfWidth = std::max(std::asin(std::min(1.0, lamp.radius_m / distance)), leastHalfWidth);
        const double arrives = std::exp(-scene_.air.lampExtinction_1_m * distance) / (distance * distance);
        for (int c = 0; c < 3; ++c)
            sum[c] += tables_.transfer[std::size_t(c)]->mean(theta, halfWidth) * lamp.intensity[c] * arrives;
    }
    return sum;
}

void DropSampler::sample(const DropPath& path, int firstRow, int lastRow, std::vector<Fragment>& fragments)
{
    const camera::Projection& picture = scene_.exposure.projection;
    const Rain& rain = scene_.rain;
    const auto widthAt = [&](const DropPath::Moment& m) { return m.focal_px * path.diameter / m.depth; };
    const auto confusionAt = [&](const DropPath::Moment& m) {
        return m.focal_px * rain.aperture_m * std::abs(1 / m.depth - rain.inverseFocus_1_m);
    };

    // What it may touch.
    glm::dvec2 low(1e300), high(-1e300);
    double widest = 0, blurred = 0;
    for (int i = 0; i < path.moments; ++i) {
        const DropPath::Moment& m = path.at[std::size_t(i)];
        low = glm::min(low, m.px);
        high = glm::max(high, m.px);
        widest = std::max(widest, widthAt(m));
        blurred = std::max(blurred, confusionAt(m));
    }
    const double across = rain.atlas != nullptr ? double(rain.atlas->acrossDiameters) : 1;
    const double reach = across * widest + 0.5 * blurred;  // a matte's corner is farther than its side
    if (high.x + reach < 0 || low.x - reach > picture.width || high.y + reach < firstRow || low.y - reach > lastRow)
        return;

    const double length = path.length_px(), spread = across * widest + blurred;
    const double footprint = (length + spread + 1) * (spread + 1);
    const double opaque = path.standsFor * path.shown * rain.opacity * pi / 4 * widest * widest / footprint;
    const double wanted = double(rain.samples) * rain.samples * footprint * std::clamp(opaque / plain, 1.0 / 16, 1.0);
    const auto count = std::uint64_t(std::clamp(std::ceil(wanted), 16.0, 4e7));

    // The matte that it wears.
    const matte::StrokeAtlas* atlas = rain.atlas;
    ConstImageViewF layer;
    double layerMean = 1;
    if (atlas != nullptr) {
        const float beads = float(optics::oscillationFrequency(2, path.diameter) * scene_.exposure.duration_s);
        const int n = matte::strokeLayer(*atlas, beads, matte::oscillationStrength(float(path.diameter)),
                                         shared::unitFloat(path.look));
        layer = atlas->layer(n);
        layerMean = tables_.layerMeans[std::size_t(n)];
    }
    const glm::dvec2 whole = path.at[std::size_t(path.moments - 1)].px - path.at[0].px;
    const double straight = glm::length(whole);
    const glm::dvec2 along = straight > 1e-3 ? whole / straight : glm::dvec2(0, 1);
    const double middleWidth = widthAt(momentAt(path, 0.5));
    const double tile = length + middleWidth;
    const bool mirrored = (path.look & 1u) != 0;
    const bool isSharp = blurred < 1e-3;
    const int onDrop = atlas != nullptr ? 1 : 2, others = onDrop + (isSharp ? 0 : 2);
    double weights = 0;

    std::array<glm::dvec3, DropPath::most> lamps{};
    if (!scene_.lamps.empty())
        for (int i = 0; i < path.moments; ++i)
            lamps[std::size_t(i)] = lampsIn(path.at[std::size_t(i)], double(i) / (path.moments - 1));

    for (std::uint64_t n = 0; n < count; ++n) {
        const auto point = latticePoint(n, count, others, path.id);
        double t = point[0], weight = 1;
        glm::dvec2 offset(0.0);
        if (atlas != nullptr) {
            const double s = point[0] * tile - 0.5 * middleWidth;  // px from the start, along the way
            t = length > 1e-3 ? std::clamp(s / length, 0.0, 1.0) : 0.5;
            const double beyond = s - t * length;  // at the round ends
            const DropPath::Moment here = momentAt(path, t);
            glm::dvec2 tangent = along;
            if (length > 1e-3) {
                const double step = 0.5 / (path.moments - 1);
                const glm::dvec2 chord = momentAt(path, t + step).px - momentAt(path, t - step).px;
                if (glm::length(chord) > 1e-6) tangent = glm::normalize(chord);
            }
            glm::dvec2 aside(-tangent.y, tangent.x);
            const bool steep = std::abs(along.y) >= std::abs(along.x);
            if ((steep ? aside.x : aside.y) < 0) aside = -aside;
            if (mirrored) aside = -aside;
            offset = beyond * tangent + (point[1] - 0.5) * across * widthAt(here) * aside;
            const int column = std::min(int(point[1] * atlas->width), atlas->width - 1);
            const int row = std::min(int(point[0] * atlas->height), atlas->height - 1);
            weight = double(layer.at(column, row)) / layerMean;
        } else {
            offset = 0.5 * widthAt(momentAt(path, t)) * onDisc(point[1], point[2]);
        }
        if (weight == 0) continue;
        weights += weight;
        const DropPath::Moment here = momentAt(path, t);
        const double width = widthAt(here), confusion = confusionAt(here);
        glm::dvec2 place = here.px + offset;
        if (!isSharp) place += 0.5 * confusion * onDisc(point[std::size_t(others - 1)], point[std::size_t(others)]);
        if (!(place.x >= 0 && place.x < picture.width && place.y >= firstRow && place.y < lastRow)) continue;
        const int x = int(place.x), y = int(place.y);
        if (!depth_.empty() && here.depth > double(depth_.at(x, y))) continue;

        const auto pixel = std::uint32_t(y) * std::uint32_t(picture.width) + std::uint32_t(x);
        Sum& sum = sums_[pixel];
        if (sum.alpha == 0) touched_.push_back(pixel);
        const double mass = pi / 4 * width * width * weight;
        const double clear = clearTo(here.depth);
        sum.alpha += mass;
        sum.depth += mass * here.depth;
        sum.clear += mass * clear;
        if (!scene_.lamps.empty()) {
            const double at = t * (path.moments - 1);
            const auto i = std::min(std::size_t(at), std::size_t(path.moments - 2));
            sum.lamps += mass * clear * glm::mix(lamps[i], lamps[i + 1], at - double(i));
        }
    }
    for (const std::uint32_t pixel : touched_) {
        Sum& sum = sums_[pixel];
        const double alpha = std::min(path.standsFor * path.shown * rain.opacity * sum.alpha / weights, 1.0);
        // Their lamps are those of all the drops that it stands for, 1 / q^2; the veil has none.
        fragments.push_back({pixel, path.id, sum.depth / sum.alpha, alpha, sum.clear / sum.alpha,
                             path.standsFor * sum.lamps / sum.alpha, whole});
        sum = {};
    }
    touched_.clear();
}

}  // namespace virga::reference
