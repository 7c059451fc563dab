#include "environment/EnvironmentLights.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <queue>

#include "environment/Luminance.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

/// Share of what a light's blur changes that is wrong about it: of round lights, whose parts are spread otherwise than
/// a ring is, and of lines.
constexpr double roundShare = 0.3, lineShare = 1.0;

/// Lights this small are not cut: the map blurs as much.
constexpr double smallest = 0.0017;  // [rad], half width of 0.1 degree

/// Wider ones stay in the harmonics, whose error for a point at order 16 is that of a blur by so much.
constexpr double widest = 0.08;  // [rad], half width of 4.6 degrees

/// Fainter ones, over the mean radiance [sr]: harmonics of order 16 are wrong by a hundredth of that for each.
constexpr double faintest = 0.003;

/// [sr] of a pixel in row y.
double solidAngle(const ImageF& image, int y)
{
    const double height = image.height();
    return 2.0 * pi / image.width() * (std::cos(pi * y / height) - std::cos(pi * (y + 1) / height));
}

/// The luminance above which light counts as a light: `threshold` times the mean of what is below.
double findLevel(const ImageF& image, double threshold)
{
    // Histogram over the logarithm of luminance; each bin keeps its solid angle and its energy.
    constexpr int bins = 512;
    constexpr double octavesPerBin = 0.125;
    std::vector<double> angle(bins, 0.0), energy(bins, 0.0);
    for (int y = 0; y < image.height(); ++y) {
        const double omega = solidAngle(image, y) / (4.0 * pi);
        for (int x = 0; x < image.width(); ++x) {
            const double value = luminance(image.pixel(x, y));
            const double place = value > 0.0 ? (std::log2(value) + 32.0) / octavesPerBin : 0.0;
            const std::size_t bin = std::size_t(std::clamp(place, 0.0, bins - 1.0));
            angle[bin] += omega;
            energy[bin] += omega * value;
        }
    }
    double mean = 0.0;
    for (const double e : energy) mean += e;
    for (int iteration = 0; iteration < 6; ++iteration) {
        double next = 0.0;
        for (std::size_t i = 0; i < energy.size(); ++i) next += std::min(energy[i], angle[i] * threshold * mean);
        mean = next;
    }
    return threshold * mean;
}

/// A pixel's part above the level.
struct Spark {
    glm::dvec3 direction, energy;
    double weight;        // luminance of the energy
    double solidAngle;    // [sr]
    double rise, across;  // mean squares of its parts' distances from its centre along the meridian and across [rad^2]
    int x, y;

    /// The same as a tensor.
    glm::dmat3 extent() const
    {
        const double level = std::hypot(direction.x, direction.z);
        const glm::dvec3 east = glm::dvec3(-direction.z, 0.0, direction.x) / level, north = glm::cross(direction, east);
        return rise * glm::outerProduct(north, north) + across * glm::outerProduct(east, east);
    }
};

/// Sparks [first, last) as one light.
struct Cluster {
    std::size_t first, last;
    Light light;
    double weight = 0, error = 0;
    int axis = 0;  // along which it is widest

    Cluster(std::span<const Spark> sparks, std::size_t from, std::size_t to, const LightLobes& lobes)
        : first(from), last(to), light{{}, {}, 0}
    {
        glm::dvec3 sum(0.0);
        glm::dmat3 squares(0.0);
        for (const Spark& spark : sparks.subspan(first, last - first)) {
            light.energy += spark.energy;
            light.solidAngle += spark.solidAngle;
            weight += spark.weight;
            sum += spark.weight * spark.direction;
            squares += spark.weight * (glm::outerProduct(spark.direction, spark.direction) + spark.extent());
        }
        const glm::dvec3 mean = sum / weight;
        const glm::dmat3 variance = squares / weight - glm::outerProduct(mean, mean);
        const glm::dvec3 along(variance[0][0], variance[1][1], variance[2][2]);
        axis = along.x >= along.y ? (along.x >= along.z ? 0 : 2) : (along.y >= along.z ? 1 : 2);
        // Parts that surround the drop evenly have no direction; such a light is not kept, see `widest`.
        const double length = glm::length(mean);
        light.direction = length > 1e-9 ? mean / length : glm::dvec3(0, 1, 0);
        const double trace = std::max(along.x + along.y + along.z, 1e-12);
        light.radius = std::sqrt(trace);
        // With the principal variances a, b across the line of sight: (a - b)^2 = 2 (a^2 + b^2) - (a + b)^2.
        double squared = 0.0;
        for (int i = 0; i < 3; ++i) squared += glm::dot(variance[i], variance[i]);
        const double elongation = std::sqrt(std::clamp(2.0 * squared / (trace * trace) - 1.0, 0.0, 1.0));
        const double share = roundShare + (lineShare - roundShare) * elongation;
        error = share * weight * lobes.blurError(halfWidth());
    }
    double halfWidth() const { return LightLobes::halfWidth(light); }
    bool canBeCut() const { return last - first > 1 && std::sqrt(1.5) * light.radius > smallest; }
    /// What cutting could take off the sum of squares.
    double curable() const { return canBeCut() ? error * error : 0.0; }
};

}  // namespace

TakenLights takeLights(ImageF& image, const LightLobes& lobes, const TakeLightsOptions& options)
{
    const double level = findLevel(image, options.threshold);
    const double mean = level / options.threshold;
    std::vector<Spark> sparks;
    const double pixel = pi / image.height();
    for (int y = 0; y < image.height(); ++y) {
        const double area = solidAngle(image, y), across = 2.0 * pi / image.width() * std::sin((y + 0.5) * pixel);
        for (int x = 0; x < image.width(); ++x) {
            const float* p = image.pixel(x, y);
            const double value = luminance(p);
            if (!(value > level)) continue;
            const glm::dvec3 energy = (1.0 - level / value) * area * glm::dvec3(p[0], p[1], p[2]);
            sparks.push_back({sh::panoramaDirection(x + 0.5, y + 0.5, image.width(), image.height()), energy,
                              area * (value - level), area, pixel * pixel / 12.0, across * across / 12.0, x, y});
        }
    }
    if (sparks.empty()) return {};

    // Cut the worst, until all that could be cut are good enough together.
    const auto better = [](const Cluster& a, const Cluster& b) {
        return a.curable() != b.curable() ? a.curable() < b.curable() : a.first > b.first;
    };
    std::priority_queue<Cluster, std::vector<Cluster>, decltype(better)> clusters(better);
    clusters.emplace(sparks, 0, sparks.size(), lobes);
    double square = clusters.top().curable();
    const double allowed = options.tolerance * mean;
    while (square > allowed * allowed && clusters.size() < options.most) {
        const Cluster worst = clusters.top();
        if (!worst.canBeCut()) break;  // what is left is rounding
        clusters.pop();
        double middle = 0.0;
        for (std::size_t i = worst.first; i < worst.last; ++i) {
            middle += sparks[i].weight / worst.weight * sparks[i].direction[worst.axis];
        }
        const auto begin = sparks.begin() + std::ptrdiff_t(worst.first);
        const auto cut =
            std::stable_partition(begin, sparks.begin() + std::ptrdiff_t(worst.last),
                                  [&](const Spark& spark) { return spark.direction[worst.axis] < middle; });
        const auto between = std::clamp(std::size_t(cut - sparks.begin()), worst.first + 1, worst.last - 1);
        square -= worst.curable();
        for (const auto& [from, to] : {std::pair{worst.first, between}, std::pair{between, worst.last}}) {
            const Cluster part(sparks, from, to, lobes);
            square += part.curable();
            clusters.push(part);
        }
    }
    std::vector<Cluster> done;
    for (; !clusters.empty(); clusters.pop()) done.push_back(clusters.top());

    TakenLights taken;
    std::stable_sort(done.begin(), done.end(), [](const Cluster& a, const Cluster& b) { return a.weight > b.weight; });
    for (const Cluster& cluster : done) {
        if (cluster.weight < faintest * mean || cluster.halfWidth() > widest) continue;
        taken.lights.push_back(cluster.light);
        taken.error = std::hypot(taken.error, cluster.error);
        for (std::size_t i = cluster.first; i < cluster.last; ++i) {
            float* p = image.pixel(sparks[i].x, sparks[i].y);
            const double keep = level / luminance(p);
            for (int c = 0; c < 3; ++c) p[c] = float(p[c] * keep);
        }
    }
    return taken;
}

}  // namespace virga::environment
