#include "shot/ShotLight.h"

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>

#include "core/Error.h"
#include "core/Log.h"
#include "io/Plate.h"

namespace virga::shot {
namespace {

environment::DropRadianceOptions bakerOptions(const Settings& s)
{
    environment::DropRadianceOptions options;
    options.paper = s.paper;
    if (s.envOrder && *s.envOrder != std::floor(*s.envOrder))
        throw Error(ErrorCode::InvalidArgument, "--env-order '{:g}': must be a whole number", *s.envOrder);
    if (s.envOrder)
        options.order = int(*s.envOrder);
    else if (s.paper)
        options.order = 3;
    else if (s.env.empty())
        options.order = environment::DropRadianceOptions::plateOrder;
    // A panorama made from the plate is smooth: what is bright in it is large.
    options.lights = !s.env.empty() && !s.paper;
    return options;
}

/// Turns to the right by whole pixels and scales. A degree is three pixels of a 1k panorama, far under a drop's blur.
void turnAndScale(ImageF& map, double yaw_deg, double gain)
{
    const int shift = int(std::lround(yaw_deg / 360 * map.width()));
    const int channels = map.channels();
    for (int y = 0; y < map.height(); ++y) {
        float* row = map.row(y);
        const int left = ((shift % map.width()) + map.width()) % map.width();
        std::rotate(row, row + std::ptrdiff_t(map.width() - left) * channels,
                    row + std::ptrdiff_t(map.width()) * channels);
        for (int i = 0; i < map.width() * channels; ++i) row[i] *= float(gain);
    }
}

}  // namespace

ShotLight::ShotLight(const Settings& settings)
    : settings_(settings), fromPlate_(settings.env.empty()), baker_(bakerOptions(settings))
{
    if (fromPlate_) return;
    environment::PanoramaReport report;
    environment::Panorama panorama =
        environment::preparePanorama(io::readLinearImage(settings.env), settings.env, &report);
    for (const std::string& sentence : report.said) log::warning("{}", sentence);
    turnAndScale(panorama.pixels, settings.envYaw_deg, settings.envGain);
    light_ = baker_.bake(panorama);
    log::detail("environment '{}': {}x{}, harmonics of order {}, {} lights apart", settings.env, report.width,
                report.height, light_.order, light_.lights.size());
}

bool ShotLight::update(ConstImageViewF plate, const camera::Projection& projection, const camera::Pose& pose)
{
    if (!fromPlate_) return !std::exchange(baked_, true);
    constexpr double widest = 170;  // deg; panoramaFromPlate's limit
    const double fov = 2 * std::atan(0.5 * projection.width / projection.focal_px);
    environment::PlatePanoramaOptions options;
    options.skyRadiance = settings_.sky;
    environment::Panorama panorama =
        environment::panoramaFromPlate(plate, std::min(fov, glm::radians(widest)), pose.worldFromCamera, options);
    turnAndScale(panorama.pixels, 0, settings_.envGain);
    light_ = baker_.bake(panorama);
    return true;
}

}  // namespace virga::shot
