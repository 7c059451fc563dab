#include "environment/Panorama.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <limits>

#include "core/Error.h"
#include "core/Parallel.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

bool isWhole(const float* pixel)
{
    return std::isfinite(pixel[0]) && std::isfinite(pixel[1]) && std::isfinite(pixel[2]);
}

/// Fills pixels that are not finite from the nearest finite ones of their row (the row is a circle), weighted by
/// nearness; rows without any from the nearest row that has some.
void fillHoles(ImageF& image)
{
    const int width = image.width(), height = image.height();
    std::vector<char> rowHasLight(std::size_t(height), 0);
    std::vector<int> valid;
    for (int y = 0; y < height; ++y) {
        valid.clear();
        for (int x = 0; x < width; ++x) {
            if (isWhole(image.pixel(x, y))) valid.push_back(x);
        }
        rowHasLight[std::size_t(y)] = !valid.empty();
        if (valid.empty() || int(valid.size()) == width) continue;
        for (std::size_t i = 0; i < valid.size(); ++i) {
            const int left = valid[i];
            const int right = i + 1 < valid.size() ? valid[i + 1] : valid.front() + width;
            for (int x = left + 1; x < right; ++x) {
                const float t = float(x - left) / float(right - left);
                for (int c = 0; c < 3; ++c) {
                    image.at(x % width, y, c) = (1 - t) * image.at(left, y, c) + t * image.at(right % width, y, c);
                }
            }
        }
    }
    for (int y = 0; y < height; ++y) {
        if (rowHasLight[std::size_t(y)]) continue;
        for (int distance = 1; distance < height; ++distance) {
            const int above = y - distance, below = y + distance;
            const int from = above >= 0 && rowHasLight[std::size_t(above)]       ? above
                             : below < height && rowHasLight[std::size_t(below)] ? below
                                                                                 : -1;
            if (from < 0) continue;
            std::copy_n(image.row(from), std::size_t(width) * 3, image.row(y));
            break;
        }
    }
}

/// A band around the horizon becomes a whole sphere: the rows above and below fade from the edge row to its mean.
ImageF wholeSphere(const ImageF& band)
{
    const int width = band.width();
    const int height = std::max(1, width / 2);
    const int top = (height - band.height()) / 2;
    ImageF sphere(width, height, 3);
    for (int y = 0; y < height; ++y) {
        const int row = std::clamp(y - top, 0, band.height() - 1);
        const int outside = std::abs(y - top - row);
        const float fade = std::min(1.0f, 4.0f * float(outside) / float(height));
        double mean[3] = {};
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c) mean[c] += band.at(x, row, c) / double(width);
        }
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c) sphere.at(x, y, c) = (1 - fade) * band.at(x, row, c) + fade * float(mean[c]);
        }
    }
    return sphere;
}

/// The largest share of all light that one pixel gives, pixels taken for equally large.
double brightestShare(const ImageF& image)
{
    double most = 0.0, total = 0.0;
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            const float* p = image.pixel(x, y);
            const double light = double(p[0]) + p[1] + p[2];
            most = std::max(most, light);
            total += light;
        }
    }
    return total > 0.0 ? most / total : 0.0;
}

/// Bilinear, around in x.
glm::dvec3 sampled(const ImageF& map, const glm::dvec3& direction)
{
    const glm::dvec2 place = sh::panoramaPlace(direction, map.width(), map.height()) - 0.5;
    const int x = int(std::floor(place.x)), y = int(std::floor(place.y));
    const double a = place.x - x, b = place.y - y;
    const auto texel = [&](int tx, int ty) {
        const float* p = map.pixel((tx + map.width()) % map.width(), std::clamp(ty, 0, map.height() - 1));
        return glm::dvec3(p[0], p[1], p[2]);
    };
    return (1 - b) * ((1 - a) * texel(x, y) + a * texel(x + 1, y)) +
           b * ((1 - a) * texel(x, y + 1) + a * texel(x + 1, y + 1));
}

bool isTransparentAllOver(ConstImageViewF rgba)
{
    for (int y = 0; y < rgba.height(); ++y) {
        for (int x = 0; x < rgba.width(); ++x) {
            if (rgba.at(x, y, 3) > 0.0f) return false;
        }
    }
    return true;
}

}  // namespace

Panorama preparePanorama(ConstImageViewF image, const std::string& name, PanoramaReport* report,
                         const PrepareOptions& options)
{
    PanoramaReport found;
    found.width = image.width();
    found.height = image.height();
    if (image.empty() || image.channels() < 1) throw Error(ErrorCode::Input, "{}: the panorama has no pixels", name);

    const double ratio = double(image.width()) / image.height();
    ImageF pixels(image.width(), image.height(), 3);
    const bool grey = image.channels() < 3;
    const bool hasAlpha = image.channels() == 4 && !isTransparentAllOver(image);
    if (image.channels() == 4 && !hasAlpha)
        found.said.push_back(fmt::format("{}: its alpha is 0 everywhere and is taken for none", name));
    for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
            const float* from = image.pixel(x, y);
            float* to = pixels.pixel(x, y);
            if (hasAlpha && !(from[3] > 0.0f)) {
                std::fill_n(to, 3, std::numeric_limits<float>::quiet_NaN());  // a hole
                ++found.transparent;
                continue;
            }
            const float alpha = hasAlpha ? from[3] : 1.0f;
            bool nan = false, infinite = false, negative = false;
            for (int c = 0; c < 3; ++c) {
                float value = from[grey ? 0 : c] / alpha;
                nan |= std::isnan(value);
                infinite |= std::isinf(value);
                if (value < 0.0f && std::isfinite(value)) {
                    negative = true;
                    value = 0.0f;
                }
                to[c] = value;
            }
            found.nan += nan;
            found.infinite += infinite && !nan;
            found.negative += negative;
        }
    }
    const std::size_t count = std::size_t(image.width()) * std::size_t(image.height());
    const std::size_t broken = found.nan + found.infinite, holes = broken + found.transparent;
    if (holes == count) throw Error(ErrorCode::Input, "{}: none of the panorama's {} pixels is a number", name, count);
    const PanoramaLayout layout =
        options.layout == PanoramaLayout::Auto ? recognisedLayout(pixels, name) : options.layout;
    requireLayout(layout, pixels, name);
    if (holes > 0) fillHoles(pixels);
    if (found.transparent > 0) {
        found.said.push_back(
            fmt::format("{}: {} transparent pixels filled from their neighbours", name, found.transparent));
    }
    if (broken > 0) {
        found.said.push_back(fmt::format("{}: {} NaN and {} infinite pixels filled from their neighbours", name,
                                         found.nan, found.infinite));
    }
    if (found.negative > 0) {
        found.said.push_back(fmt::format("{}: {} pixels with negative values cut to 0", name, found.negative));
    }
    for (const float value : pixels.values()) found.brightest = std::max(found.brightest, value);
    found.black = found.brightest == 0.0f;
    if (found.black) found.said.push_back(fmt::format("{}: the panorama is black; drops will return no light", name));

    if (const double share = brightestShare(pixels); share > 0.9 && count >= 64) {
        found.said.push_back(
            fmt::format("{}: one pixel of {:.3g} gives {:.4g} % of the light; it is taken for a lamp, paint "
                        "it out if it is none",
                        name, double(found.brightest), 100 * share));
    }
    switch (layout) {
        case PanoramaLayout::Uniform: found.takenFor = "a uniform sphere"; break;
        case PanoramaLayout::Sphere:
            found.takenFor = "a full sphere";
            if (image.width() != 2 * image.height()) {
                found.said.push_back(fmt::format("{}: {} x {} pixels is not quite 2:1; taken for a full sphere", name,
                                                 image.width(), image.height()));
            }
            break;
        case PanoramaLayout::Band:
            found.takenFor = fmt::format("a band of 360 x {:.0f} degrees around the horizon", 360.0 / ratio);
            found.said.push_back(
                fmt::format("{}: {} x {} pixels is wider than 2:1; taken for {}, filled above and below from "
                            "its edges",
                            name, image.width(), image.height(), found.takenFor));
            pixels = wholeSphere(pixels);
            break;
        default:
            found.takenFor = layoutInWords(layout);
            found.said.push_back(fmt::format("{}: {} x {} pixels; taken for {} and unfolded to a full sphere", name,
                                             image.width(), image.height(), found.takenFor));
            pixels = unfolded(pixels, layout);
    }
    if (report) *report = std::move(found);
    return {std::move(pixels)};
}

Panorama turned(const Panorama& panorama, const glm::dmat3& worldFromOld)
{
    const int width = panorama.pixels.width(), height = panorama.pixels.height();
    const glm::dmat3 oldFromWorld = glm::transpose(worldFromOld);
    Panorama result{ImageF(width, height, 3)};
    parallelFor(0, height, 4, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (int y = int(first); y < int(last); ++y) {
            for (int x = 0; x < width; ++x) {
                glm::dvec3 sum(0.0);
                for (const double j : {0.25, 0.75}) {
                    for (const double i : {0.25, 0.75}) {
                        sum +=
                            sampled(panorama.pixels, oldFromWorld * sh::panoramaDirection(x + i, y + j, width, height));
                    }
                }
                for (int c = 0; c < 3; ++c) result.pixels.at(x, y, c) = float(sum[c] / 4.0);
            }
        }
    });
    return result;
}

}  // namespace virga::environment
