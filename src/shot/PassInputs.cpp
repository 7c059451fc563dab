#include "shot/PassInputs.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "core/Parallel.h"
#include "passes/SplashPass.h"
#include "shot/LampReach.h"

namespace virga::shot {
namespace {

/// Depth of the middle entry of the fog and veil tables [m].
constexpr double fogTableScale = 20;
constexpr std::size_t tableSize = shared::fogTableSize;

double depthOfEntry(std::size_t entry)
{
    const double place = double(entry) / double(tableSize - 1);
    return place < 1 ? fogTableScale * place / (1 - place) : std::numeric_limits<double>::infinity();
}

}  // namespace

/// The veil's second sum has the light that the fog in front of it lets through.
PassInputs::Tables PassInputs::tablesFor(const particles::Exposure& exposure) const
{
    const particles::Visibility visibility = rain ? rain->visibility(exposure) : particles::Visibility{};
    Tables tables{std::vector<float>(tableSize), std::vector<float>(2 * tableSize)};
    std::vector<float>&fog = tables.fog, &veil = tables.veil;
    parallelFor(0, std::ptrdiff_t(tableSize), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto i = std::size_t(first); i < std::size_t(last); ++i) {
            if (plan.features.fog) fog[i] = float(fogOpticalDepth(depthOfEntry(i), exposure));
            if (plan.features.veil) veil[2 * i] = float(rain->veil(depthOfEntry(i), exposure, visibility));
        }
    });
    for (std::size_t i = 1; i < tableSize; ++i) {
        const float clear = 0.5f * (std::exp(-fog[i - 1]) + std::exp(-fog[i]));
        veil[2 * i + 1] = veil[2 * i - 1] + clear * (veil[2 * i] - veil[2 * i - 2]);
    }
    return tables;
}

shared::FrameConstants PassInputs::constantsFor(const particles::Exposure& exposure, const Tables& tables,
                                                std::size_t lampsInUse) const
{
    shared::FrameConstants c{};
    const auto cameraFromWorld = [](const camera::Pose& pose) {
        return glm::mat4(glm::mat3(glm::transpose(pose.worldFromCamera)));
    };
    const camera::Projection& projection = exposure.projection;
    c.cameraFromWorldOpen = cameraFromWorld(exposure.poseAtOpen);
    c.cameraFromWorldClose = cameraFromWorld(exposure.poseAtClose);
    c.lens = {float(projection.focal_px), float(projectionAt(exposure.poseAtClose).focal_px),
              float(projection.axisX_px), float(projection.axisY_px)};
    c.range = {float(settings.near_m), float(settings.far_m), 0, float(settings.opacity)};
    c.focus = {float(lensFocal_m(projection) / settings.fstop), float(1 / settings.focus_m), float(exposure.duration_s),
               float(fogTableScale)};
    c.picture = {std::uint32_t(projection.width), std::uint32_t(projection.height), 0, 0};
    if (settings.fogColor) {
        const auto& color = *settings.fogColor;
        c.fogColor = {float(color[0]), float(color[1]), float(color[2]), 1};
    }
    c.boost = {float(settings.paper ? 0.7 : settings.backgroundBoost), settings.paper ? 1.0f : 0.0f, 0,
               float(projection.fullFocal_px())};
    c.grade = {float(settings.darken), float(settings.desaturate), float(settings.blur_px * projection.scale),
               float(settings.blurDistance_m)};
    c.lights.x = std::uint32_t(lampsInUse);
    if (plan.features.fog) c.medium.x = float(extinctionAround(exposure));
    c.lut = {lut.delta, lut.maximum, float(lut.size), 0};
    if (rain) {
        const particles::Visibility visibility = rain->visibility(exposure);
        c.range.z = float(visibility.threshold);
        c.medium.y = float(visibility.thin);
        c.medium.z = tables.veil[2 * tableSize - 2];
        c.medium.w = tables.veil[2 * tableSize - 1];
        c.boost.z = float(rain->opticalDepth(settings.fogDistance_m, exposure));
    }
    if (plan.features.fog && settings.fog_1_m) c.boost.z = float(*settings.fog_1_m * settings.fogDistance_m);
    if (plan.features.splashes) rain->describeSplashes(c, exposure, settings);
    c.splashKey.w = std::uint32_t(passes::SplashPass::capacity(projection.width, projection.height));
    return c;
}

particles::CellList PassInputs::cellsIn(const particles::Exposure& exposure, const particles::FarthestDepth* farthest,
                                        double matteWidthDiameters) const
{
    particles::Visibility visibility = rain->visibility(exposure);
    visibility.skipsOutOfView = plan.skips.outOfView;
    visibility.skipsFaint = plan.skips.faint;
    if (farthest == nullptr) return rain->field().cellsInView(exposure, visibility);
    const camera::Projection& open = exposure.projection;
    const auto [least, greatest] = std::minmax({open.focal_px, projectionAt(exposure.poseAtClose).focal_px});
    const particles::HiddenCells hidden(*farthest, {.leastFocal_px = least,
                                                    .greatestFocal_px = greatest,
                                                    .axisX_px = open.axisX_px,
                                                    .axisY_px = open.axisY_px,
                                                    .aperture_m = visibility.aperture_m,
                                                    .inverseFocus_1_m = 1 / settings.focus_m,
                                                    .near_m = settings.near_m,
                                                    .matteWidthDiameters = matteWidthDiameters});
    visibility.hidden = &hidden;
    return rain->field().cellsInView(exposure, visibility);
}

/// The farthest that a drop gets while the shutter is open [m], the camera's own way left out.
double PassInputs::dropWay(const particles::Exposure& exposure) const
{
    const particles::Motion& motion = rain->field().motion();
    double farthest = 0;
    for (const rainfall::SizeClass& c : rain->field().classes())
        farthest = std::max(farthest, glm::length(motion.displacement(c.speed, exposure.open_s + exposure.duration_s) -
                                                  motion.displacement(c.speed, exposure.open_s)));
    return farthest + 2 * motion.turbulenceReach();
}

std::vector<SceneLight> PassInputs::seenLamps(const particles::Exposure& exposure, double greatestTransfer_1_sr) const
{
    if (!plan.skips.farLamps) return lamps;
    return lampsInReach(lamps, exposure, settings.far_m, extinctionAround(exposure), greatestTransfer_1_sr,
                        dropWay(exposure));
}

std::vector<shared::PointLight> PassInputs::fromCamera(const std::vector<SceneLight>& lamps,
                                                       const particles::Exposure& exposure)
{
    std::vector<shared::PointLight> seen;
    for (const SceneLight& lamp : lamps)
        seen.push_back({glm::vec4(glm::vec3(lamp.position - exposure.poseAtOpen.position), float(lamp.radius_m)),
                        glm::vec4(glm::vec3(lamp.intensity), 0.0f)});
    return seen;
}

}  // namespace virga::shot
