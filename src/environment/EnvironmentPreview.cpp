#include "environment/EnvironmentPreview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "core/Parallel.h"
#include "sh/Harmonics.h"
#include "sh/Panorama.h"

namespace virga::environment {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int pictureWidth = 800, pictureHeight = 400, gap = 8, textHeight = 28;

/// The map at the size of a picture on the sheet: means of what a pixel covers, or bilinear where that is less than
/// one.
ImageF fitted(const ImageF& map)
{
    cv::Mat from(map.height(), map.width(), CV_32FC3, const_cast<float*>(map.data()));
    ImageF result(pictureWidth, pictureHeight, 3);
    cv::Mat to(pictureHeight, pictureWidth, CV_32FC3, result.data());
    cv::resize(from, to, to.size(), 0, 0, map.width() > pictureWidth ? cv::INTER_AREA : cv::INTER_LINEAR);
    return result;
}

/// White letters on the sheet's grey.
void write(ImageF& sheet, const std::string& text, int left, int bottom)
{
    cv::Mat canvas(sheet.height(), sheet.width(), CV_32FC3, sheet.data());
    cv::putText(canvas, text, {left, bottom}, cv::FONT_HERSHEY_SIMPLEX, 0.55, cv::Scalar(0.8, 0.8, 0.8), 1, cv::LINE_8);
}

/// Hershey's fonts have ASCII alone.
std::string ascii(const std::string& text, std::size_t longest)
{
    std::string result;
    for (const char c : text) result += c >= ' ' && c <= '~' ? c : '?';
    if (result.size() > longest) result = "..." + result.substr(result.size() - longest + 3);
    return result;
}

/// Bilinear.
ImageF enlargedPanorama(const Panorama& panorama, int width)
{
    ImageF larger(width, width / 2, 3);
    for (int y = 0; y < width / 2; ++y) {
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 value =
                sampleMap(panorama.pixels, sh::panoramaDirection(x + 0.5, y + 0.5, width, width / 2));
            for (int c = 0; c < 3; ++c) larger.at(x, y, c) = float(value[c]);
        }
    }
    return larger;
}

}  // namespace

sh::Harmonics harmonicsOf(const Panorama& panorama, int order)
{
    const int least = 4 * (order + 1);
    if (panorama.pixels.width() >= 2 * least && panorama.pixels.height() >= least)
        return sh::projectPanorama(panorama.pixels, order);
    return sh::projectPanorama(enlargedPanorama(panorama, 2 * least), order);
}

ImageF keptByDrops(const DropRadiance& baked, const std::vector<double> (&f)[3], int width)
{
    sh::Harmonics kept = baked.response;
    for (int l = 0; l <= kept.order; ++l) {
        for (int m = -l; m <= l; ++m) {
            for (int c = 0; c < 3; ++c) kept.coefficient[sh::coefficientIndex(l, m)][c] /= f[c][std::size_t(l)];
        }
    }
    const int height = width / 2;
    ImageF map = sh::bakePanorama(kept, width, height);
    // A disc of twice the root mean square extent, and of a pixel at least, holds the energy.
    for (const Light& light : baked.lights) {
        const double radius = std::max(std::sqrt(2.0) * light.radius, pi / height);
        const double cosRadius = std::cos(radius), solidAngle = 2.0 * pi * (1.0 - cosRadius);
        const glm::dvec2 place = sh::panoramaPlace(light.direction, width, height);
        const int rows = int(radius / pi * height) + 1;
        for (int y = std::max(0, int(place.y) - rows); y <= std::min(height - 1, int(place.y) + rows); ++y) {
            for (int x = 0; x < width; ++x) {
                if (glm::dot(sh::panoramaDirection(x + 0.5, y + 0.5, width, height), light.direction) < cosRadius)
                    continue;
                for (int c = 0; c < 3; ++c) map.at(x, y, c) += float(light.energy[c] / solidAngle);
            }
        }
    }
    return map;
}

ImageF previewSheet(const Panorama& panorama, const DropRadiance& baked, const std::string& name)
{
    std::vector<double> f[3];
    for (int c = 0; c < 3; ++c)
        f[c] = optics::zonalCoefficients(baked.order, {.index = optics::waterIndex[std::size_t(c)]});
    const int width = std::max(pictureWidth, 4 * (baked.order + 1));
    const struct {
        ImageF picture;
        std::string text;
    } pictures[] = {
        {fitted(panorama.pixels),
         fmt::format("{}: {} x {}", ascii(name, 60), panorama.pixels.width(), panorama.pixels.height())},
        {fitted(sh::bakePanorama(harmonicsOf(panorama, 3), width, width / 2)), "what harmonics of order 3 keep of it"},
        {fitted(keptByDrops(baked, f, width)), fmt::format("what is used: order {} and {} light{} apart", baked.order,
                                                           baked.lights.size(), baked.lights.size() == 1 ? "" : "s")},
        {fitted(baked.radiance), "the light that a drop returns, by the direction in which it is seen"},
    };

    // The mean of what drops return is the panorama's, but no single light decides it.
    double mean = 0.0, weights = 0.0;
    for (int y = 0; y < pictureHeight; ++y) {
        const double weight = std::sin(pi * (y + 0.5) / pictureHeight);
        for (int x = 0; x < pictureWidth; ++x) {
            const float* p = pictures[3].picture.pixel(x, y);
            mean += weight * std::log(std::max(0.2126f * p[0] + 0.7152f * p[1] + 0.0722f * p[2], 0.0f) + 1e-6f);
            weights += weight;
        }
    }
    const float exposure = float(0.25 / std::exp(mean / weights));

    ImageF sheet(2 * pictureWidth + 3 * gap, 2 * (pictureHeight + gap + textHeight), 3, 0.03f);
    for (int k = 0; k < 4; ++k) {
        const int left = gap + (k % 2) * (pictureWidth + gap),
                  top = textHeight + (k / 2) * (pictureHeight + gap + textHeight);
        write(sheet, pictures[k].text, left, top - 9);
        for (int y = 0; y < pictureHeight; ++y) {
            for (int i = 0; i < 3 * pictureWidth; ++i) {
                // Over a half the exposure bends, so that skies keep their clouds and lights their place.
                const float value = exposure * pictures[k].picture.row(y)[i];
                sheet.pixel(left, top + y)[i] = value <= 0.5f ? value : 1.0f - 0.25f / value;
            }
        }
    }
    return sheet;
}

}  // namespace virga::environment
