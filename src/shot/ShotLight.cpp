#include "shot/ShotLight.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "camera/Camera.h"
#include "core/Counters.h"
#include "core/Error.h"
#include "core/KeptInMemory.h"
#include "core/Log.h"
#include "environment/Highlights.h"
#include "io/Plate.h"
#include "shot/KeptLight.h"
#include "shot/PanoramaFile.h"

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
    // The boost takes what drops of this order leave out for granted, and the paper's fog is the paper's. Else fog
    // shows the same at every order.
    if (s.backgroundBoost == 0 && !s.paper)
        options.backgroundOrder =
            s.env.empty() ? environment::DropRadianceOptions::plateOrder : environment::DropRadianceOptions::autoOrder;
    // A panorama made from the plate is smooth: what is bright in it is large.
    options.lights = !s.env.empty() && !s.paper;
    return options;
}

void scale(environment::DropRadiance& light, double gain)
{
    if (gain == 1) return;
    for (ImageF* map : {&light.radiance, &light.background})
        for (float& value : map->values()) value *= float(gain);
}

ImageF copyOf(ConstImageViewF image)
{
    ImageF copy(image.width(), image.height(), image.channels());
    for (int y = 0; y < image.height(); ++y)
        std::copy_n(image.row(y), std::size_t(image.width()) * std::size_t(image.channels()), copy.row(y));
    return copy;
}

}  // namespace

ShotLight::ShotLight(const Settings& settings, std::span<const environment::PlateView> views, bool keepsPanorama,
                     const KeptFiles& kept, std::shared_ptr<const PicturesInMemory> inMemory)
    : settings_(settings), options_(bakerOptions(settings)), kept_(kept), inMemory_(std::move(inMemory)),
      keepsPanorama_(keepsPanorama)
{
    if (settings.env.empty()) {
        isEachFrame_ = views.empty();
        if (!isEachFrame_) light_ = keptFromViews(views);
        return;
    }
    // First up about the camera's x, then to the right about the vertical: what was ahead is seen at (yaw, pitch).
    environmentFromWorld_ =
        glm::transpose(camera::rotationZXY(glm::radians(settings.envPitch_deg), -glm::radians(settings.envYaw_deg), 0));
    if (io::isFramePattern(settings.env))
        keyFrames_.emplace(settings.env, [this](const std::string& path) { return fromFile(path); });
    else
        light_ = fromFile(settings.env);
}

const environment::DropRadianceBaker& ShotLight::baker()
{
    if (!madeBaker_) madeBaker_.emplace(options_);
    return *madeBaker_;
}

environment::DropRadiance ShotLight::fromFile(const std::string& path)
{
    // Whoever wants the panorama itself has it read.
    const PicturesInMemory* const given = inMemory_ && isPanoramaInMemory(path) ? inMemory_.get() : nullptr;
    const std::string key = keepsPanorama_ ? ""
                            : given        ? keptLightKey(given->panorama, path, options_, settings_)
                                           : keptLightKey(path, options_, settings_);
    std::optional<KeptLight> found = loadLight(kept_, key);
    if (!found) {
        found.emplace();
        environment::PanoramaReport report;
        ++counters().environments;
        environment::Panorama panorama =
            given ? repairedPanorama(given->panorama, path, given->endsAtWhite, settings_.lightRadiance, &report,
                                     &found->said)
                  : readPanorama(path, settings_.lightRadiance, &report, settings_.ocio, &found->said);
        found->light = baker().bake(panorama);
        found->width = report.width;
        found->height = report.height;
        storeLight(kept_, key, *found);
        keep(std::move(panorama));
    } else {
        found->said.log();
    }
    scale(found->light, settings_.envGain);
    log::detail("environment '{}': {}x{}, harmonics of order {}, {} lights apart", path, found->width, found->height,
                found->light.order, found->light.lights.size());
    return std::move(found->light);
}

environment::DropRadiance ShotLight::keptFromViews(std::span<const environment::PlateView> views)
{
    KeptInMemory* const memory = keepsPanorama_ ? nullptr : KeptInMemory::ofThread();
    if (memory == nullptr) return fromViews(views);
    // Of a plate's own colours nothing is worth a file: the next run has another plate.
    const std::string key = keptLightKey(views, options_, settings_);
    const KeptFiles noFolder;
    if (std::optional<KeptLight> found = loadLight(noFolder, key)) return std::move(found->light);
    environment::DropRadiance light = fromViews(views);
    storeLight(noFolder, key, {light, 0, 0, {}});
    return light;
}

environment::DropRadiance ShotLight::fromViews(std::span<const environment::PlateView> views)
{
    ++counters().environments;
    environment::PlatePanoramaOptions options;
    options.skyRadiance = settings_.sky;
    std::vector<ImageF> repaired;
    std::vector<environment::PlateView> brighter(views.begin(), views.end());
    if (settings_.lightRadiance) {
        repaired.reserve(views.size());
        for (environment::PlateView& view : brighter) {
            environment::repairPlateHighlights(repaired.emplace_back(copyOf(view.plate)), *settings_.lightRadiance);
            view.plate = repaired.back();
        }
    }
    environment::Panorama panorama = environment::panoramaFromViews(brighter, options);
    environment::DropRadiance light = baker().bake(panorama);
    scale(light, settings_.envGain);
    keep(std::move(panorama));
    return light;
}

void ShotLight::keep(environment::Panorama panorama)
{
    if (!keepsPanorama_) return;
    panorama_ = std::move(panorama);
    for (float& value : panorama_.pixels.values()) value *= float(settings_.envGain);
}

bool ShotLight::update(FrameNumber frame, const environment::PlateView& view, bool isSamePlate)
{
    const bool isFirst = !std::exchange(isShown_, true);
    if (keyFrames_) return keyFrames_->moveTo(frame, light_);
    if (!isEachFrame_) return isFirst;
    const bool isSameView = view.horizontalFov == lastFov_ && view.worldFromCamera == lastWorldFromCamera_;
    if (isSamePlate && isSameView) return false;
    light_ = fromViews({&view, 1});
    lastFov_ = view.horizontalFov;
    lastWorldFromCamera_ = view.worldFromCamera;
    return true;
}

}  // namespace virga::shot
