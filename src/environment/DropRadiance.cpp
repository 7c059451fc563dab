#include "environment/DropRadiance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <optional>
#include <span>

#include "core/Error.h"
#include "core/Parallel.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int paperTerms = 9;
constexpr double lightThreshold = 8.0;  // times the mean
constexpr std::size_t maxLights = 64;
constexpr int lampWidth = 512, sunWidth = 1024;  // of maps that hold lights, see bake()

glm::dvec3 pixelAt(const ImageF& image, int x, int y)
{
    const float* p = image.pixel(x, y);
    return {p[0], p[1], p[2]};
}

double luminance(const glm::dvec3& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

/// Bilinear, so that the projection's rows are enough for its order.
ImageF enlarged(const ImageF& image, int width, int height)
{
    ImageF result(width, height, 3);
    parallelFor(0, height, 32, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < width; ++x) {
                const double fx = (x + 0.5) / width * image.width() - 0.5;
                const double fy = std::clamp((y + 0.5) / height * image.height() - 0.5, 0.0, image.height() - 1.0);
                const int x0 = int(std::floor(fx)), y0 = int(fy);
                const int xa = (x0 + image.width()) % image.width(), xb = (x0 + 1) % image.width();
                const int yb = std::min(y0 + 1, image.height() - 1);
                const double tx = fx - x0, ty = fy - y0;
                const glm::dvec3 value = (1 - ty) * ((1 - tx) * pixelAt(image, xa, y0) + tx * pixelAt(image, xb, y0)) +
                                         ty * ((1 - tx) * pixelAt(image, xa, yb) + tx * pixelAt(image, xb, yb));
                for (int c = 0; c < 3; ++c) result.at(x, y, c) = float(value[c]);
            }
        }
    });
    return result;
}

/// The least power of two, or three times one, that is at least `wanted`: what FFTs and textures like.
int niceWidth(int wanted)
{
    int width = 64;
    while (width < wanted) width = width % 3 == 0 ? width / 3 * 4 : width / 2 * 3;
    return width;
}

/// Integrals over the sphere by solid angle, for what need not be band-limited.
class SolidAngle {
public:
    SolidAngle(int width, int height) : width_(width), height_(height) {}
    /// [sr] of a pixel in row y
    double operator()(int y) const
    {
        return 2.0 * pi / width_ * (std::cos(pi * y / height_) - std::cos(pi * (y + 1) / height_));
    }

private:
    int width_, height_;
};

/// The luminance above which light counts as a light: 8 times the mean of what is below.
double findThreshold(const ImageF& image)
{
    // Histogram over the logarithm of luminance; each bin keeps its solid angle and its energy.
    constexpr int bins = 512;
    constexpr double octavesPerBin = 0.125;
    std::vector<double> angle(bins, 0.0), energy(bins, 0.0);
    const SolidAngle solidAngle(image.width(), image.height());
    for (int y = 0; y < image.height(); ++y) {
        const double omega = solidAngle(y) / (4.0 * pi);
        for (int x = 0; x < image.width(); ++x) {
            const double value = luminance(pixelAt(image, x, y));
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
        for (std::size_t i = 0; i < energy.size(); ++i) next += std::min(energy[i], angle[i] * lightThreshold * mean);
        mean = next;
    }
    return lightThreshold * mean;
}

/// Moves what rises over the threshold out of `image`, by cells of 2.8 degrees, the brightest maxLights of them.
std::vector<Light> takeLights(ImageF& image)
{
    const double threshold = findThreshold(image);
    const auto excess = [threshold](const glm::dvec3& value) {
        const double y = luminance(value);
        return y > threshold ? 1.0 - threshold / y : 0.0;
    };
    const int columns = std::min(128, image.width()), rows = std::min(64, image.height());
    const auto cellOf = [&](int x, int y) {
        return std::size_t(std::int64_t(y) * rows / image.height()) * std::size_t(columns) +
               std::size_t(std::int64_t(x) * columns / image.width());
    };
    struct Cell {
        glm::dvec3 energy{0.0}, direction{0.0};
        double weight = 0.0;
    };
    std::vector<Cell> cells(std::size_t(columns) * std::size_t(rows));
    const SolidAngle solidAngle(image.width(), image.height());
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            const glm::dvec3 value = pixelAt(image, x, y);
            const double share = excess(value);
            if (!(share > 0.0)) continue;
            Cell& cell = cells[cellOf(x, y)];
            const glm::dvec3 energy = share * solidAngle(y) * value;
            const double weight = luminance(energy);
            cell.energy += energy;
            cell.weight += weight;
            cell.direction += weight * sh::panoramaDirection(x + 0.5, y + 0.5, image.width(), image.height());
        }
    }
    std::vector<std::size_t> bright;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        if (cells[i].weight > 0.0) bright.push_back(i);
    }
    std::stable_sort(bright.begin(), bright.end(),
                     [&](std::size_t a, std::size_t b) { return cells[a].weight > cells[b].weight; });
    if (bright.size() > maxLights) bright.resize(maxLights);
    // Harmonics are wrong about a light of energy e by less than e / 2, so the faint ones may stay.
    while (!bright.empty() && cells[bright.back()].weight < 0.003 * threshold / lightThreshold) bright.pop_back();

    std::vector<Light> lights;
    std::vector<char> taken(cells.size(), 0);
    const double pixel = pi / image.height();
    for (const std::size_t i : bright) {
        taken[i] = 1;
        // Directions spread over an angle r have a mean of length 1 - r^2 / 2; a pixel is not a point either.
        const double length = std::min(1.0, glm::length(cells[i].direction) / cells[i].weight);
        lights.push_back({glm::normalize(cells[i].direction), cells[i].energy,
                          std::sqrt(2.0 * (1.0 - length) + pixel * pixel / 6.0)});
    }
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            if (!taken[cellOf(x, y)]) continue;
            const double keep = 1.0 - excess(pixelAt(image, x, y));
            for (int c = 0; c < 3; ++c) image.at(x, y, c) = float(image.at(x, y, c) * keep);
        }
    }
    return lights;
}

/// What a light adds to the radiance of drops, over the angle between them: RingTransfer by table, as one light meets
/// every pixel. The table goes in equal steps of the chord from the light, then of the chord to its opposite: a square
/// root finds the place, and steps are under a tenth of a degree everywhere.
class LightLobe {
public:
    LightLobe(const Light& light, const std::vector<optics::RingTransfer>& ring, double halfWidth)
        : value_(2 * half + 2)
    {
        for (int i = 0; i <= 2 * half; ++i) {
            const double chord = (i <= half ? i : 2 * half - i) / scale;
            const double angle = 2.0 * std::asin(std::min(chord, 1.0));
            const double theta = i <= half ? angle : pi - angle;
            for (int c = 0; c < 3; ++c) {
                value_[std::size_t(i)][c] = float(light.energy[c] * ring[std::size_t(c)].mean(theta, halfWidth));
            }
        }
        value_[2 * half + 1] = value_[2 * half];
    }
    glm::vec3 operator()(double cosine) const
    {
        const double chord = std::sqrt(std::max(0.0, 0.5 * (1.0 - std::abs(cosine)))) * scale;
        const double place = std::min(cosine >= 0.0 ? chord : 2.0 * half - chord, 2.0 * half);
        const int i = int(place);
        const float t = float(place - i);
        return (1.0f - t) * value_[std::size_t(i)] + t * value_[std::size_t(i) + 1];
    }

private:
    static constexpr int half = 1024;
    static constexpr double scale = half * std::numbers::sqrt2;
    std::vector<glm::vec3> value_;
};

/// Adds lights, blurred by a pixel of the map.
void addLights(ImageF& map, std::span<const Light> lights, const std::vector<optics::RingTransfer>& ring)
{
    if (lights.empty()) return;
    const double pixel = 2.0 * pi / map.width();
    std::vector<LightLobe> lobes;
    lobes.reserve(lights.size());
    for (const Light& light : lights) lobes.emplace_back(light, ring, std::hypot(0.5 * pixel, light.radius));
    parallelFor(0, map.height(), 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < map.width(); ++x) {
                const glm::dvec3 direction = sh::panoramaDirection(x + 0.5, y + 0.5, map.width(), map.height());
                glm::vec3 sum(0.0f);
                for (std::size_t i = 0; i < lights.size(); ++i)
                    sum += lobes[i](glm::dot(direction, lights[i].direction));
                for (int c = 0; c < 3; ++c) map.at(x, y, c) += sum[c];
            }
        }
    });
}

/// Low-pass to `order` that neither rings nor changes the mean: a Gaussian, down to e^-4 at the last band.
std::vector<double> gaussianWindow(int order)
{
    std::vector<double> window(std::size_t(order) + 1);
    for (int l = 0; l <= order; ++l) {
        window[std::size_t(l)] = std::exp(-4.0 * l * (l + 1.0) / ((order + 1.0) * (order + 2.0)));
    }
    return window;
}

}  // namespace

DropRadianceBaker::DropRadianceBaker(const DropRadianceOptions& options) : options_(options)
{
    if (options.order != DropRadianceOptions::autoOrder &&
        (options.order < 0 || options.order > DropRadianceOptions::maxOrder)) {
        throw Error(ErrorCode::InvalidArgument, "environment order {}: must be auto or from 0 to {}", options.order,
                    DropRadianceOptions::maxOrder);
    }
    if (!(options.tolerance > 0.0)) {
        throw Error(ErrorCode::InvalidArgument, "environment tolerance {}: must be over 0", options.tolerance);
    }
    if (options.paper) {
        options_.lights = false;
        if (options.order == DropRadianceOptions::autoOrder) options_.order = 3;
    }
    // Some bands more than are kept tell how much is left out.
    const int order =
        options_.order == DropRadianceOptions::autoOrder ? DropRadianceOptions::maxAutoOrder : options_.order + 16;
    std::array<std::optional<optics::RingTransfer>, 3> ring;
    parallelFor(0, 3, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::size_t c = std::size_t(first); c < std::size_t(last); ++c) {
            optics::DropTransferOptions transfer;
            transfer.index = options_.paper ? 1.333 : options_.index[c];
            transfer.model = options_.paper ? optics::PathModel::Paper : optics::PathModel::Polarised;
            transfer.terms = options_.paper ? paperTerms : 0;
            factor_[c] = optics::zonalCoefficients(order, transfer);
            if (options_.lights) ring[c].emplace(transfer);
        }
    });
    for (auto& r : ring) {
        if (r) ring_.push_back(std::move(*r));
    }
}

DropRadiance DropRadianceBaker::bake(const Panorama& panorama) const
{
    assert(!panorama.pixels.empty() && panorama.pixels.channels() == 3);
    const bool automatic = options_.order == DropRadianceOptions::autoOrder;
    const int searched = int(factor_[0].size()) - 1;

    DropRadiance result;
    result.paper = options_.paper;
    ImageF changed;
    const ImageF* image = &panorama.pixels;
    const int least = 2 * searched + 2;
    if (image->height() < least || image->width() < 2 * least) {
        changed = enlarged(*image, niceWidth(std::max(2 * least, image->width())), std::max(least, image->height()));
        image = &changed;
    }
    if (options_.lights) {
        if (changed.empty()) changed = *image;
        result.lights = takeLights(changed);
        image = &changed;
    }

    sh::Harmonics environment = sh::projectPanorama(*image, searched);
    // Root mean square that the bands above `order` would add, over the mean: Parseval. What lies above the searched
    // bands is known by its energy alone; the last factor bounds theirs.
    const std::vector<glm::dvec3> band = sh::bandEnergies(environment);
    const double mean = std::sqrt(band[0].r + band[0].g + band[0].b);
    glm::dvec3 rest(0.0);
    const std::vector<double> weight = sh::rowWeights(image->height());
    for (int y = 0; y < image->height(); ++y) {
        glm::dvec3 row(0.0);
        for (int x = 0; x < image->width(); ++x) row += pixelAt(*image, x, y) * pixelAt(*image, x, y);
        rest += weight[std::size_t(y)] * 2.0 * pi / image->width() * row;
    }
    for (const glm::dvec3& energy : band) rest -= energy;
    rest = glm::max(rest, glm::dvec3(0.0));
    double leftOut = 0.0;
    for (int c = 0; c < 3; ++c) {
        const std::vector<double>& f = factor_[c];
        const double bound = std::max(std::abs(f.back()), f.size() > 1 ? std::abs(f[f.size() - 2]) : 0.0);
        leftOut += bound * bound * rest[c];
    }
    int order = searched;
    const auto relative = [mean](double square) { return mean > 0.0 ? std::sqrt(square) / mean : 0.0; };
    while (order > (automatic ? 0 : options_.order)) {
        double more = leftOut;
        for (int c = 0; c < 3; ++c) {
            const double f = factor_[c][std::size_t(order)];
            more += f * f * band[std::size_t(order)][c];
        }
        if (automatic && relative(more) > options_.tolerance) break;
        leftOut = more;
        --order;
    }
    result.order = order;
    result.remainder = relative(leftOut);
    environment = sh::truncated(environment, order);

    // Harmonics need 8 pixels to a wave of the highest band; a light's rainbow needs finer ones, a sun's the finest.
    const double sky = luminance(environment.coefficient[0]) / std::sqrt(4.0 * pi);
    const auto firstFaint = std::find_if(result.lights.begin(), result.lights.end(),
                                         [sky](const Light& light) { return luminance(light.energy) < 0.25 * sky; });
    const std::span<const Light> suns(result.lights.begin(), firstFaint), lamps(firstFaint, result.lights.end());
    int width = std::max(8 * (order + 1), 64);
    if (!lamps.empty()) width = std::max(width, lampWidth);
    if (!suns.empty()) width = std::max(width, sunWidth);
    width = niceWidth(width);
    result.response = environment;
    const std::vector<double> window = gaussianWindow(order);
    sh::convolve(environment, {window, window, window});
    result.background = sh::bakePanorama(environment, width, width / 2);
    sh::convolve(result.response, factor_);
    result.radiance = sh::bakePanorama(result.response, width, width / 2);
    addLights(result.radiance, suns, ring_);
    if (width > lampWidth && lamps.size() > 4) {
        ImageF coarse(lampWidth, lampWidth / 2, 3);
        addLights(coarse, lamps, ring_);
        const ImageF fine = enlarged(coarse, width, width / 2);
        for (std::size_t i = 0; i < fine.size(); ++i) result.radiance.data()[i] += fine.data()[i];
    } else {
        addLights(result.radiance, lamps, ring_);
    }
    if (!options_.paper) {
        for (ImageF* map : {&result.radiance, &result.background}) {
            for (float& value : map->values()) value = std::max(value, 0.0f);
        }
    }
    return result;
}

glm::dvec3 DropRadianceBaker::exactly(const DropRadiance& radiance, const glm::dvec3& direction) const
{
    constexpr double sharpest = pi / 1440.0;
    const glm::dvec3 v = glm::normalize(direction);
    glm::dvec3 sum = sh::evaluate(radiance.response, v);
    for (const Light& light : radiance.lights) {
        const double theta = std::acos(std::clamp(glm::dot(v, light.direction), -1.0, 1.0));
        for (int c = 0; c < 3; ++c) {
            sum[c] += light.energy[c] * ring_[std::size_t(c)].mean(theta, std::max(light.radius, sharpest));
        }
    }
    return sum;
}

glm::dvec3 sampleMap(ConstImageViewF map, const glm::dvec3& direction)
{
    const glm::dvec2 place = sh::panoramaPlace(direction, map.width(), map.height()) - 0.5;
    const double x = std::floor(place.x), y = std::floor(place.y);
    const auto texel = [&](double tx, double ty) {
        const int wrapped = ((int(tx) % map.width()) + map.width()) % map.width();
        const float* p = map.pixel(wrapped, std::clamp(int(ty), 0, map.height() - 1));
        return glm::dvec3(p[0], p[1], p[2]);
    };
    const double a = place.x - x, b = place.y - y;
    return (1 - b) * ((1 - a) * texel(x, y) + a * texel(x + 1, y)) +
           b * ((1 - a) * texel(x, y + 1) + a * texel(x + 1, y + 1));
}

}  // namespace virga::environment
