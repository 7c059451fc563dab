#include "environment/DropRadiance.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "core/Error.h"
#include "core/Parallel.h"
#include "environment/Luminance.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int paperTerms = 9;
constexpr std::array lightWidths{512, 1024, 2048};  // of maps that hold lights, see bake()
// Of the tolerance: for the lights' extents, and for the blur of a light by the map's pixels.
constexpr double lightShare = 0.4, blurShare = 0.25;

/// The least power of two, or three times one, that is at least `wanted`: what FFTs and textures like.
int niceWidth(int wanted)
{
    int width = 64;
    while (width < wanted) width = width % 3 == 0 ? width / 3 * 4 : width / 2 * 3;
    return width;
}

/// Which of lightWidths a light wants: the first whose pixels blur it, and what lies around it, by less than `allowed`
/// (root mean square radiance).
std::vector<std::size_t> widthsOf(const std::vector<Light>& lights, const LightLobes& lobes, double allowed)
{
    constexpr double near = 0.9986;  // cosine of 3 degrees: errors of lights so close add up
    std::vector<std::size_t> wanted;
    for (const Light& light : lights) {
        double energy = 0.0;
        for (const Light& other : lights) {
            if (glm::dot(light.direction, other.direction) > near) energy += luminance(other.energy);
        }
        const double sharp = lobes.blurError(LightLobes::halfWidth(light));
        std::size_t i = 0;
        while (i + 1 < lightWidths.size() &&
               energy * (lobes.blurError(LightLobes::halfWidth(light, pi / lightWidths[i])) - sharp) > allowed) {
            ++i;
        }
        wanted.push_back(i);
    }
    return wanted;
}

/// Adds `coarse`, bilinear, to a map of the same sphere.
void addEnlarged(ImageF& map, const ImageF& coarse)
{
    const int width = map.width(), height = map.height();
    parallelFor(0, height, 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            const float fy = std::clamp((float(y) + 0.5f) / float(height) * float(coarse.height()) - 0.5f, 0.0f,
                                        float(coarse.height() - 1));
            const int y0 = int(fy), y1 = std::min(y0 + 1, coarse.height() - 1);
            const float ty = fy - float(y0);
            for (int x = 0; x < width; ++x) {
                const float fx = (float(x) + 0.5f) / float(width) * float(coarse.width()) - 0.5f;
                const int x0 = int(std::floor(fx));
                const float tx = fx - float(x0);
                const int xa = (x0 + coarse.width()) % coarse.width(), xb = (x0 + 1) % coarse.width();
                const float *a = coarse.pixel(xa, y0), *b = coarse.pixel(xb, y0), *c = coarse.pixel(xa, y1),
                            *d = coarse.pixel(xb, y1);
                float* to = map.pixel(x, y);
                for (int k = 0; k < 3; ++k) {
                    to[k] += (1 - ty) * ((1 - tx) * a[k] + tx * b[k]) + ty * ((1 - tx) * c[k] + tx * d[k]);
                }
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
    constexpr int automatic = DropRadianceOptions::autoOrder, same = DropRadianceOptions::sameOrder;
    for (const int order : {options.order, options.backgroundOrder == same ? automatic : options.backgroundOrder}) {
        if (order != automatic && (order < 0 || order > DropRadianceOptions::maxOrder)) {
            throw Error(ErrorCode::InvalidArgument, "environment order {}: must be auto or from 0 to {}", order,
                        DropRadianceOptions::maxOrder);
        }
    }
    if (!(options.tolerance > 0.0)) {
        throw Error(ErrorCode::InvalidArgument, "environment tolerance {}: must be over 0", options.tolerance);
    }
    if (!(options.lightThreshold > 1.0)) {
        throw Error(ErrorCode::InvalidArgument, "threshold of lights {}: must be over 1 times the mean",
                    options.lightThreshold);
    }
    if (options.paper) {
        options_.lights = false;
        if (options.order == automatic) options_.order = 3;
    }
    if (options_.backgroundOrder == same) options_.backgroundOrder = options_.order;
    // Some bands more than are kept tell how much is left out.
    const auto searched = [](int order, int more) {
        return order == automatic ? DropRadianceOptions::maxAutoOrder : order + more;
    };
    const int order = std::max(searched(options_.order, 16), searched(options_.backgroundOrder, 0));
    std::array<optics::DropTransferOptions, 3> transfer;
    for (std::size_t c = 0; c < 3; ++c) {
        transfer[c].index = options_.paper ? 1.333 : options_.index[c];
        transfer[c].model = options_.paper ? optics::PathModel::Paper : optics::PathModel::Polarised;
        transfer[c].terms = options_.paper ? paperTerms : 0;
        factor_[c] = optics::zonalCoefficients(order, transfer[c]);
    }
    if (options_.lights) lobes_.emplace(transfer);
}

DropRadiance DropRadianceBaker::bake(const Panorama& panorama) const
{
    assert(!panorama.pixels.empty() && panorama.pixels.channels() == 3);
    const int searched = int(factor_[0].size()) - 1;

    DropRadiance result;
    result.paper = options_.paper;
    ImageF without;
    const ImageF* image = &panorama.pixels;
    TakenLights taken;
    if (options_.lights) {
        without = panorama.pixels;
        taken = takeLights(without, *lobes_,
                           {.threshold = options_.lightThreshold, .tolerance = lightShare * options_.tolerance});
        image = &without;
    }
    result.lights = std::move(taken.lights);

    sh::Harmonics environment = sh::projectPanorama(*image, searched, sh::PixelValue::Mean);
    const std::vector<glm::dvec3> band = sh::bandEnergies(environment);
    glm::dvec3 lightEnergy(0.0);
    for (const Light& light : result.lights) lightEnergy += light.energy;
    // Root mean square over R, G, B of the mean radiance, times 4 pi and the root of 4 pi: as coefficients are.
    const double mean = glm::length(environment.coefficient[0] + lightEnergy / std::sqrt(4.0 * pi));
    const auto relative = [mean](double square) { return mean > 0.0 ? std::sqrt(square) / mean : 0.0; };
    const double lightSquare = 4.0 * pi * taken.error * taken.error;

    // Root mean square that the bands above `order` would add: Parseval. What lies above the searched bands is known by
    // its energy alone; the largest of the last factors bounds theirs.
    glm::dvec3 whole(0.0);
    for (int y = 0; y < image->height(); ++y) {
        const float* p = image->row(y);
        glm::dvec3 row(0.0);
        for (int x = 0; x < image->width(); ++x, p += 3)
            row += glm::dvec3(p[0], p[1], p[2]) * glm::dvec3(p[0], p[1], p[2]);
        const double height = image->height();
        whole += 2.0 * pi / image->width() * (std::cos(pi * y / height) - std::cos(pi * (y + 1) / height)) * row;
    }
    const double allowed = options_.tolerance * options_.tolerance - (mean > 0.0 ? lightSquare / (mean * mean) : 0.0);
    const double tolerance = std::sqrt(std::max(allowed, 0.5 * options_.tolerance * options_.tolerance));
    struct Cut {
        int order;
        double leftOut;
    };
    // autoOrder looks at the same bands whatever else is asked for.
    const auto cutTo = [&](int wanted) {
        const bool automatic = wanted == DropRadianceOptions::autoOrder;
        Cut cut{automatic ? DropRadianceOptions::maxAutoOrder : searched, 0.0};
        for (int c = 0; c < 3; ++c) {
            double above = whole[c], bound = 0.0;
            for (int l = 0; l <= cut.order; ++l) {
                above -= band[std::size_t(l)][c];
                if (l > cut.order - 12) bound = std::max(bound, std::abs(factor_[c][std::size_t(l)]));
            }
            cut.leftOut += bound * bound * std::max(above, 0.0);
        }
        while (cut.order > (automatic ? 0 : wanted)) {
            double more = cut.leftOut;
            for (int c = 0; c < 3; ++c) {
                const double f = factor_[c][std::size_t(cut.order)];
                more += f * f * band[std::size_t(cut.order)][c];
            }
            if (automatic && relative(more) > tolerance) break;
            cut.leftOut = more;
            --cut.order;
        }
        return cut;
    };
    const Cut cut = cutTo(options_.order);
    result.order = cut.order;
    result.remainder = relative(cut.leftOut + lightSquare);

    // Harmonics need 8 pixels to a wave of the highest band; a light's rainbow needs finer ones.
    const auto widthOf = [](int order) { return niceWidth(std::max(8 * (order + 1), 64)); };
    const int smooth = widthOf(cut.order);
    result.response = sh::truncated(environment, cut.order);
    sh::convolve(result.response, factor_);

    const int backgroundOrder =
        options_.backgroundOrder == options_.order ? cut.order : cutTo(options_.backgroundOrder).order;
    const std::vector<double> window = gaussianWindow(backgroundOrder);
    environment = sh::truncated(environment, backgroundOrder);
    sh::convolve(environment, {window, window, window});
    result.background = sh::bakePanorama(environment, widthOf(backgroundOrder), widthOf(backgroundOrder) / 2);

    if (result.lights.empty()) {
        result.radiance = sh::bakePanorama(result.response, smooth, smooth / 2);
    } else {
        // From the coarsest map to the finest, each enlarged to the next.
        const double sky = mean / std::sqrt(3.0 * 4.0 * pi);
        const std::vector<std::size_t> wanted = widthsOf(result.lights, *lobes_, blurShare * options_.tolerance * sky);
        const std::size_t finest = *std::max_element(wanted.begin(), wanted.end());
        ImageF lit;
        for (std::size_t i = 0; i <= finest; ++i) {
            std::vector<Light> lights;
            for (std::size_t k = 0; k < wanted.size(); ++k) {
                if (wanted[k] == i) lights.push_back(result.lights[k]);
            }
            if (lights.empty() && lit.empty()) continue;
            const int width = i == finest ? niceWidth(std::max(lightWidths[i], smooth)) : lightWidths[i];
            ImageF finer =
                i == finest ? sh::bakePanorama(result.response, width, width / 2) : ImageF(width, width / 2, 3);
            if (!lit.empty()) addEnlarged(finer, lit);
            lobes_->add(finer, lights);
            lit = std::move(finer);
        }
        result.radiance = std::move(lit);
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
    const glm::dvec3 v = glm::normalize(direction);
    glm::dvec3 sum = sh::evaluate(radiance.response, v);
    for (const Light& light : radiance.lights) {
        const double theta = std::atan2(glm::length(glm::cross(v, light.direction)), glm::dot(v, light.direction));
        sum += light.energy * lobes_->mean(theta, LightLobes::halfWidth(light));
    }
    return sum;
}

}  // namespace virga::environment
