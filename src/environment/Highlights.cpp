#include "environment/Highlights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;

constexpr double compact = 0.03;         // [sr], the largest light: 11 degrees across
constexpr double compactInPlate = 0.02;  // of the frame
constexpr double groundToLight = 0.15;   // radiance of the ground over irradiance / pi
constexpr double leastSine = 0.25;       // lights near the horizon light walls, if not the ground
constexpr double beyond = 0.5;           // how much brighter than white bright surfaces are
constexpr double brightestLight = 2e5;   // the sun over a grey card's 0.18
constexpr double widestShare = 0.6;
constexpr double brightestRim = 0.7;  // of what surrounds a light: a cloud's is brighter
constexpr int fewLights = 3;          // so few are certain
constexpr double sun = 7e-5;          // [sr]

double luminance(const glm::dvec3& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }  // Rec.709

glm::dvec3 colorAt(ImageView<float> image, int x, int y)
{
    const float* p = image.pixel(x, y);
    return {p[0], p[1], p[2]};
}

/// What of a picture is cut off. Regions are of pixels with all channels at white: a blue sky loses blue long before
/// anything in it is as bright as a lamp.
struct Clipped {
    double white = 0;
    float from = 0;         // channels from here on are cut off
    std::size_t count = 0;  // pixels with one channel or more
    double size = 0;        // of them, [sr] or share of the frame
    cv::Mat labels;         // 0: is in none; else the number of its region
    cv::Mat depth;          // [px], to the region's edge
    struct Region {
        double size = 0;               // [sr], or share of the frame
        double elevation = 0;          // [rad], mean
        glm::dvec3 surroundings{0.0};  // mean colour of what touches it
        double touching = 0;
        float deepest = 0;
    };
    std::vector<Region> regions;  // [0] is the rest
};

/// white: 1, or nothing to take the brightest value for it. sizeOfRow: what a pixel of each row counts.
Clipped findClipped(ImageView<float> image, std::optional<double> white, const std::vector<double>& sizeOfRow)
{
    Clipped found;
    const int width = image.width(), height = image.height();
    float brightest = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            for (int c = 0; c < 3; ++c) brightest = std::max(brightest, image.at(x, y, c));
        }
    }
    found.white = white.value_or(brightest);
    // 252 of 255 for JPEG's ripples; a true maximum is cut off exactly.
    found.from = float(found.white * (white ? 0.972 : 0.999));
    if (!(brightest >= found.from) || brightest <= 0.0f) return found;

    // Columns are counted from where the fewest are cut off, so that regions across the border stay whole.
    cv::Mat mask(height, width, CV_8U, cv::Scalar(0));
    std::vector<int> inColumn(std::size_t(width), 0);
    const auto isClipped = [&](int x, int y) {
        const float* p = image.pixel(x, y);
        return std::min({p[0], p[1], p[2]}) >= found.from;
    };
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) inColumn[std::size_t(x)] += isClipped(x, y);
    }
    const int start = int(std::min_element(inColumn.begin(), inColumn.end()) - inColumn.begin());
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const bool clipped = isClipped((x + start) % width, y);
            mask.at<unsigned char>(y, x) = clipped ? 255 : 0;
            if (!clipped && std::max({image.at((x + start) % width, y, 0), image.at((x + start) % width, y, 1),
                                      image.at((x + start) % width, y, 2)}) < found.from)
                continue;
            ++found.count;
            found.size += sizeOfRow[std::size_t(y)];
        }
    }
    cv::Mat labels, depth;
    const int regions = cv::connectedComponents(mask, labels, 8, CV_32S);
    cv::distanceTransform(mask, depth, cv::DIST_L2, 3, CV_32F);
    found.labels.create(height, width, CV_32S);
    found.depth.create(height, width, CV_32F);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            found.labels.at<int>(y, (x + start) % width) = labels.at<int>(y, x);
            found.depth.at<float>(y, (x + start) % width) = depth.at<float>(y, x);
        }
    }

    found.regions.resize(std::size_t(regions));
    for (int y = 0; y < height; ++y) {
        const double elevation = pi / 2 - pi * (y + 0.5) / height;
        for (int x = 0; x < width; ++x) {
            const int label = found.labels.at<int>(y, x);
            if (label == 0) continue;
            Clipped::Region& region = found.regions[std::size_t(label)];
            region.size += sizeOfRow[std::size_t(y)];
            region.elevation += sizeOfRow[std::size_t(y)] * elevation;
            region.deepest = std::max(region.deepest, found.depth.at<float>(y, x));
            if (found.depth.at<float>(y, x) > 1.5f) continue;
            for (int j = std::max(y - 2, 0); j <= std::min(y + 2, height - 1); j += 2) {
                for (int i = x - 2; i <= x + 2; i += 2) {
                    const int wrapped = (i + width) % width;
                    if (found.labels.at<int>(j, wrapped) != 0) continue;
                    region.surroundings += colorAt(image, wrapped, j);
                    region.touching += 1.0;
                }
            }
        }
    }
    for (Clipped::Region& region : found.regions) {
        if (region.size > 0.0) region.elevation /= region.size;
        if (region.touching > 0.0) region.surroundings /= region.touching;
    }
    return found;
}

/// A light's colour of luminance 1: its glow's, half way to grey.
glm::dvec3 tint(const Clipped::Region& region)
{
    const double glow = luminance(region.surroundings);
    return glow > 0.0 ? 0.5 * (region.surroundings / glow + glm::dvec3(1.0)) : glm::dvec3(1.0);
}

void raise(float* pixel, const glm::dvec3& color)
{
    for (int c = 0; c < 3; ++c) pixel[c] = std::max(pixel[c], float(color[c]));
}

}  // namespace

HighlightReport repairHighlights(Panorama& panorama, const std::string& name, const HighlightOptions& options)
{
    HighlightReport report;
    if (!options.endsAtWhite && !options.lightRadiance) return report;
    ImageF& image = panorama.pixels;
    const int width = image.width(), height = image.height();
    std::vector<double> solidAngle(static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y)
        solidAngle[std::size_t(y)] = 2.0 * pi / width * (std::cos(pi * y / height) - std::cos(pi * (y + 1) / height));
    const Clipped clipped =
        findClipped(image, options.endsAtWhite ? std::optional<double>(1.0) : std::nullopt, solidAngle);
    report.white = clipped.white;
    report.clipped = clipped.count;
    if (clipped.count == 0) return report;
    report.share = clipped.size / (4.0 * pi);
    if (report.share > widestShare) {
        report.said.push_back(fmt::format(
            "{}: {:.0f} % of the panorama is at white; that is too much to tell what was cut off, so it stays "
            "as it is; a shorter exposure has what is missing",
            name, 100 * report.share));
        return report;
    }

    // Bright surfaces first: they rise from their edge over 4 pixels, each channel by what share of them is cut off.
    const bool isTrueRange = !options.endsAtWhite;
    for (int y = 0; y < height && !isTrueRange; ++y) {
        for (int x = 0; x < width; ++x) {
            float* pixel = image.pixel(x, y);
            const int channels = (pixel[0] >= clipped.from) + (pixel[1] >= clipped.from) + (pixel[2] >= clipped.from);
            if (channels == 0) continue;
            const double depth = std::max(1.0f, clipped.depth.at<float>(y, x));
            const double rise = std::min(1.0, 0.25 + (depth - 1.0) / 4.0);
            for (int c = 0; c < 3; ++c) {
                if (pixel[c] >= clipped.from) pixel[c] *= float(1.0 + beyond * rise * channels / 3.0);
            }
        }
    }

    // Lights: compact regions that stand out, and the inside of the largest of the others.
    std::vector<char> isCompact(clipped.regions.size(), 0);
    std::size_t largest = 0;
    const auto choose = [&](double lowest) {
        for (std::size_t i = 1; i < clipped.regions.size(); ++i) {
            const Clipped::Region& region = clipped.regions[i];
            if (region.size > compact) {
                if (largest == 0 || region.size > clipped.regions[largest].size) largest = i;
                continue;
            }
            if (region.elevation < lowest || isCompact[i]) continue;
            if (!isTrueRange && luminance(region.surroundings) > brightestRim * clipped.white) continue;
            isCompact[i] = 1;
            ++report.lights;
        }
    };
    choose(-5.0 * pi / 180.0);
    if (report.lights == 0 && largest == 0) choose(-pi);  // reflections, for want of anything else
    const bool hasCore = largest != 0 && (report.lights == 0 || !options.lightRadiance);
    const float core = largest != 0 ? 0.7f * clipped.regions[largest].deepest : 0.0f;

    struct Spot {
        int x, y;
        std::size_t region;
        float depth;
        double solidAngle, sine;
    };
    std::vector<Spot> spots;
    double ground = 0.0, groundWeight = 0.0, irradiance = 0.0, lights = 0.0;
    for (int y = 0; y < height; ++y) {
        const double up = std::cos(pi * (y + 0.5) / height), size = solidAngle[std::size_t(y)];
        for (int x = 0; x < width; ++x) {
            const double brightness = luminance(colorAt(image, x, y));
            if (up < 0.0) {
                ground -= up * size * brightness;
                groundWeight -= up * size;
            } else {
                irradiance += up * size * brightness;
            }
            const std::size_t region = std::size_t(clipped.labels.at<int>(y, x));
            const float depth = clipped.depth.at<float>(y, x);
            if (region == 0 || !(isCompact[region] || (hasCore && region == largest && depth >= core))) continue;
            spots.push_back({x, y, region, depth, size, std::max(up, leastSine)});
            lights += spots.back().sine * size;
        }
    }
    const double missing = pi * ground / groundWeight / groundToLight - irradiance;
    if (options.lightRadiance) {
        report.lightRadiance = *options.lightRadiance;
        // Among many regions, or inside a large one, the deepest pixels are the likeliest, as many as the ground asks
        // for.
        if (report.lights == 0 || report.lights > fewLights) {
            std::stable_sort(spots.begin(), spots.end(),
                             [](const Spot& a, const Spot& b) { return a.depth > b.depth; });
            double given = 0.0, size = 0.0;
            std::size_t count = 0;
            while (count < spots.size() && (size < sun || given < missing)) {
                given += spots[count].sine * spots[count].solidAngle * *options.lightRadiance;
                size += spots[count++].solidAngle;
            }
            spots.resize(count);
        }
    } else if (missing > 0.0 && lights > 0.0) {
        report.lightRadiance = std::min(clipped.white + missing / lights, brightestLight);
        report.isEstimate = true;
    }
    if (report.lightRadiance) {
        for (const Spot& spot : spots)
            raise(image.pixel(spot.x, spot.y), *report.lightRadiance * tint(clipped.regions[spot.region]));
    }
    report.lights += hasCore;
    report.said.push_back(fmt::format(
        "{}: {} pixels, {:.2g} % of the panorama, are cut off at white and were made brighter{}", name, report.clipped,
        100 * report.share,
        !report.lightRadiance ? std::string()
        : report.isEstimate
            ? fmt::format("; {} of their regions are taken for lights of radiance {:.3g}, which is an estimate; "
                          "--light-radiance sets it",
                          report.lights, *report.lightRadiance)
            : fmt::format("; {} of their regions got radiance {:.3g}", report.lights, *report.lightRadiance)));
    return report;
}

HighlightReport repairPlateHighlights(ImageView<float> plate, double lightRadiance)
{
    HighlightReport report;
    if (plate.empty()) return report;
    const double share = 1.0 / (double(plate.width()) * plate.height());
    const Clipped clipped =
        findClipped(plate, 1.0, std::vector<double>(static_cast<std::size_t>(plate.height()), share));
    report.white = clipped.white;
    report.clipped = clipped.count;
    report.share = clipped.size;
    report.lightRadiance = lightRadiance;
    if (clipped.count == 0) return report;
    for (std::size_t i = 1; i < clipped.regions.size(); ++i) report.lights += clipped.regions[i].size <= compactInPlate;
    for (int y = 0; y < plate.height(); ++y) {
        for (int x = 0; x < plate.width(); ++x) {
            const std::size_t label = std::size_t(clipped.labels.at<int>(y, x));
            if (label == 0 || clipped.regions[label].size > compactInPlate) continue;
            raise(plate.pixel(x, y), lightRadiance * tint(clipped.regions[label]));
        }
    }
    return report;
}

}  // namespace virga::environment
