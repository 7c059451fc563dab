#include "reference/Picture.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "core/Parallel.h"
#include "optics/Airlight.h"
#include "reference/DepthBlur.h"
#include "reference/RainLayer.h"

namespace virga::reference {
namespace {

/// Of every pixel's middle, world axes, length 1.
std::vector<glm::dvec3> directionsOf(const particles::Exposure& exposure)
{
    const camera::Projection& p = exposure.projection;
    std::vector<glm::dvec3> directions;
    for (int y = 0; y < p.height; ++y)
        for (int x = 0; x < p.width; ++x)
            directions.push_back(exposure.poseAtOpen.worldFromCamera *
                                 glm::normalize(glm::dvec3(x + 0.5 - p.axisX_px, p.axisY_px - y - 0.5, -p.focal_px)));
    return directions;
}

ImageD imageOf(const std::vector<glm::dvec3>& values, int width, int height)
{
    ImageD image(width, height, 3);
    for (std::size_t i = 0; i < values.size(); ++i)
        for (int c = 0; c < 3; ++c) image.data()[3 * i + std::size_t(c)] = values[i][c];
    return image;
}

ImageD graded(const Scene& scene, ConstImageViewF plate)
{
    ImageD result(plate.width(), plate.height(), 4);
    for (int y = 0; y < plate.height(); ++y)
        for (int x = 0; x < plate.width(); ++x) {
            const float* p = plate.pixel(x, y);
            std::array<double, 3> color = {double(p[0]), double(p[1]), double(p[2])};
            if (scene.colorTransfer != nullptr) {
                const double alpha = p[3] > 0 ? double(p[3]) : 1;  // colours move as they are where nothing covers them
                for (double& c : color) c /= alpha;
                color = grade::apply(*scene.colorTransfer, color);
                for (double& c : color) c *= alpha;
            }
            color = grade::darkened(color, scene.darkening);
            for (int c = 0; c < 3; ++c) result.at(x, y, c) = color[std::size_t(c)];
            result.at(x, y, 3) = double(p[3]);
        }
    return result;
}

/// What the lamps' light adds on its way through the air along a pixel's direction, up to `distance` [m].
glm::dvec3 glow(const Scene& scene, const glm::dvec3& direction, double distance)
{
    glm::dvec3 sum(0.0);
    for (const Lamp& lamp : scene.lamps) {
        const glm::dvec3 way = lamp.position - scene.exposure.poseAtOpen.position;
        const double along = glm::dot(way, direction);
        const double across = std::max(glm::length(way - along * direction), lamp.radius_m);
        sum += lamp.intensity * optics::airlight(along, across, distance, scene.air.lampExtinction_1_m);
    }
    return sum;
}

void layOver(const ImageD& front, ImageD& back)
{
    for (std::size_t i = 0; i < back.size(); i += 4) {
        const double clear = 1 - front.data()[i + 3];
        for (std::size_t c = i; c < i + 4; ++c) back.data()[c] = front.data()[c] + clear * back.data()[c];
    }
}

}  // namespace

Picture render(const Scene& scene, ConstImageViewF plate, ConstImageViewF depth)
{
    const int width = plate.width(), height = plate.height();
    Picture picture;
    picture.plate = graded(scene, plate);
    if (scene.blur_px > 0) picture.plate = depthBlur(picture.plate, depth, scene.blur_px, scene.blurDistance_m);
    picture.beauty = picture.plate;
    picture.fog = picture.rain = ImageD(width, height, 4);

    const bool hasFog = bool(scene.air.opticalDepth), hasRain = scene.rain.field != nullptr;
    if (!hasFog && !hasRain) return picture;
    const std::vector<glm::dvec3> directions = directionsOf(scene.exposure);
    const ImageD lit = imageOf(scene.dropLight(directions), width, height);
    ImageD fogLight(width, height, 3);
    if (hasFog) {
        fogLight = imageOf(scene.behind(directions), width, height);
        for (std::size_t i = 0; i < fogLight.size(); ++i)
            fogLight.data()[i] =
                scene.air.color ? (*scene.air.color)[int(i % 3)] : 0.5 * (fogLight.data()[i] + lit.data()[i]);
        parallelFor(0, height, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
            for (int y = int(first); y < int(last); ++y)
                for (int x = 0; x < width; ++x) {
                    const double metres = depth.empty() ? scene.air.openDepth_m : double(depth.at(x, y));
                    double* fog = picture.fog.pixel(x, y);
                    fog[3] = -std::expm1(-scene.air.opticalDepth(metres));
                    for (int c = 0; c < 3; ++c) fog[c] = fog[3] * fogLight.at(x, y, c);
                    if (scene.lamps.empty()) continue;
                    const glm::dvec3& direction = directions[std::size_t(y) * std::size_t(width) + std::size_t(x)];
                    // Depth is along the axis, the way to the surface along the ray.
                    const double reach =
                        std::min(depth.empty() ? 1e300 : double(depth.at(x, y)), scene.rain.visibility.far_m);
                    const double slant = -1 / glm::dot(scene.exposure.poseAtOpen.worldFromCamera[2], direction);
                    const glm::dvec3 added = glow(scene, direction, reach * slant);
                    for (int c = 0; c < 3; ++c) fog[c] += added[c];
                }
        });
        layOver(picture.fog, picture.beauty);
    }
    RainLayer rain = rainLayer(scene, depth, lit, fogLight);
    picture.rain = std::move(rain.rain);
    picture.nearestDepth = std::move(rain.depth);
    picture.nearestMotion = std::move(rain.motion);
    picture.strokes = rain.strokes;
    layOver(picture.rain, picture.beauty);
    return picture;
}

}  // namespace virga::reference
