#include "shot/ShotScene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "core/Error.h"
#include "core/Log.h"
#include "io/ImageFile.h"
#include "shot/CameraTrack.h"
#include "shot/View.h"

namespace virga::shot {
namespace {

camera::Track trackOf(const Settings& settings, const Shot& shot)
{
    if (!shot.track.empty()) return shot.track;
    if (settings.camera == "plate")
        throw Error(ErrorCode::InvalidArgument, "--camera plate: there is no plate's file to read it from");
    if (hasCameraFile(settings)) return readCameraTrack(settings);
    return camera::Track({{0, standingPose(settings)}});
}

}  // namespace

camera::Pose standingPose(const Settings& settings)
{
    if (settings.ground.empty()) return {};
    const Ground ground = parseGround(settings.ground);
    return camera::pitchedPose({0, ground.height_m, 0}, glm::radians(ground.pitch_deg));
}

double exposureOf(const Settings& settings, double fps)
{
    // What rain adds to a picture falls as 1 / sqrt(exposure) (Garg and Nayar 2005): at film's 1/48 s it is hardly
    // there. Footage in which rain shows was shot with the short exposures of daylight.
    constexpr double daylight_s = 1.0 / 200;
    if (settings.exposure_s) return *settings.exposure_s;
    return settings.shutter_deg ? *settings.shutter_deg / 360 / fps : std::min(daylight_s, 1 / fps);
}

ShotScene::ShotScene(const Settings& settings_, const Shot& shot_, const Wanted& wanted, const PlateSamples& samples,
                     const KeptFiles& kept)
    : wanted_(wanted), kept_(kept), plateFps_(shot_.fps),
      givenTrack_(shot_.track), region_{0, 0, shot_.width, shot_.height}
{
    settings = settings_;
    shot = shot_;
    make(~0u, samples);
}

unsigned ShotScene::change(const Settings& next, const PlateSamples& samples)
{
    const unsigned parts = partsThatDiffer(settings, next);
    settings = next;
    make(parts, samples);
    return parts;
}

/// Parts that are not wanted now are made when they are.
void ShotScene::make(unsigned parts, const PlateSamples& samples)
{
    if (parts & TimePart) shot.fps = settings.fps.value_or(plateFps_);
    if (parts & CameraPart) {
        Shot given = shot;
        given.track = givenTrack_;
        track = trackOf(settings, given);
    }
    if (parts & RainPart) rain = nullptr;
    if (parts & LightPart) light = nullptr;
    if (parts & DepthPart) depth = nullptr;
    if (parts & LampsPart) lamps.clear();
    if (parts & TransferPart) lut = {};
    plan = planFrame(settings, wanted_, !track.isStatic());
    if (plan.isPassThrough()) return;
    const particles::Exposure first = frameExposureAt(shot.firstFrame);
    if (plan.features.colorTransfer && lut.rgb.empty()) makeTransfer(samples.forGrade);
    if ((plan.features.rain || plan.features.fog || plan.features.splashes) && !rain)
        rain = std::make_shared<const RainModel>(settings, first);
    if (plan.features.light() && !light) makeLight(samples.forLight);
    if (plan.features.lights && lamps.empty() && !settings.lights.empty()) lamps = readLights(settings.lights);
    if (plan.features.depth && !depth) depth = std::make_shared<DepthSource>(settings, first.poseAtOpen, shot.inMemory);
}

void ShotScene::makeTransfer(const std::vector<ImageF>& samples)
{
    const std::vector<ConstImageViewF> frames(samples.begin(), samples.end());
    const ImageF still = io::readLinearImage(settings.gradeFrom, {}, settings.ocio);
    try {
        lut = grade::makeColorTransfer(frames, still, {.strength = settings.gradeAmount});
    } catch (const Error& error) {
        throw Error(error.code(), "--grade-from '{}': {}", settings.gradeFrom, error.what());
    }
}

void ShotScene::look(double scale, const Window& region)
{
    scale_ = scale;
    region_ = region;
}

Window ShotScene::frameWindow() const { return frameAt(shot.width, shot.height, scale_); }

camera::Projection ShotScene::frameProjectionAt(const camera::Pose& pose) const
{
    return !settings.fov_deg && pose.verticalFov
               ? camera::projectionFromVerticalFov(shot.width, shot.height, *pose.verticalFov)
               : camera::projectionFromHorizontalFov(shot.width, shot.height,
                                                     glm::radians(settings.fov_deg.value_or(60.0)));
}

camera::Projection ShotScene::projectionAt(const camera::Pose& pose) const
{
    return camera::partOf(frameProjectionAt(pose), scale_, region_);
}

particles::Exposure ShotScene::frameExposureAt(FrameNumber frame) const { return exposureAt(double(frame), true); }
particles::Exposure ShotScene::exposureAt(double frame) const { return exposureAt(frame, false); }

particles::Exposure ShotScene::exposureAt(double frame, bool ofFrame) const
{
    particles::Exposure exposure;
    exposure.open_s = frame / shot.fps;
    exposure.duration_s = exposureOf(settings, shot.fps);
    exposure.poseAtOpen = track.at(frame);
    exposure.poseAtClose = track.at(frame + exposure.duration_s * shot.fps);
    exposure.projection = ofFrame ? frameProjectionAt(exposure.poseAtOpen) : projectionAt(exposure.poseAtOpen);
    return exposure;
}

std::shared_ptr<const depth::Depth> ShotScene::depthAt(FrameNumber frame, const particles::Exposure& exposure,
                                                       ConstImageViewF plate, bool isSamePlate)
{
    const Window whole = frameWindow();
    return depth->at(frame, exposure.poseAtOpen, {whole.width, whole.height, region_, exposure.projection.focal_px},
                     plate, isSamePlate);
}

double ShotScene::lensFocal_m(const camera::Projection& projection) const
{
    return 1e-3 * settings.sensorWidth_mm * projection.focal_px / projection.frameWidth_px;
}

double ShotScene::extinctionAround(const particles::Exposure& exposure) const
{
    return settings.fog_1_m ? *settings.fog_1_m : rain->opticalDepth(100, exposure) / 100;
}

double ShotScene::fogOpticalDepth(double depth_m, const particles::Exposure& exposure) const
{
    const double depth = fogDepth(depth_m);
    return settings.fog_1_m ? *settings.fog_1_m * std::min(depth, settings.far_m) : rain->opticalDepth(depth, exposure);
}

double ShotScene::fogDepth(double depth_m) const
{
    // A ground plane says nothing of what stands on it: fog that grew with its depth would draw the horizon across
    // houses and trees. It levels off at --fog-distance instead.
    const bool levelsOff = settings.depth.empty() && !settings.ground.empty();
    if (!levelsOff) return depth_m;
    if (std::isinf(depth_m)) return settings.fogDistance_m;
    return depth_m * settings.fogDistance_m / std::max(depth_m + settings.fogDistance_m, 1e-9);
}

environment::PlateView ShotScene::viewOf(ConstImageViewF plate, FrameNumber frame) const
{
    constexpr double widest_deg = 170;  // panoramaFromViews' limit
    const camera::Pose pose = track.at(double(frame));
    const double fov = 2 * std::atan(0.5 * shot.width / frameProjectionAt(pose).focal_px);
    return {plate, std::min(fov, glm::radians(widest_deg)), pose.worldFromCamera};
}

void ShotScene::makeLight(const std::vector<PlateSamples::Frame>& samples)
{
    // Beyond this the surroundings are others.
    constexpr double travel_m = 3;
    std::string whyNot;
    bool together = !samples.empty();
    if (together && track.isStatic()) {
        together = isSteady(samples, whyNot);
    } else if (together) {
        const glm::dvec3 start = track.at(double(samples.front().number)).position;
        for (const PlateSamples::Frame& sample : samples)
            together = together && glm::distance(track.at(double(sample.number)).position, start) <= travel_m;
        if (!together) whyNot = "the camera travels";
    }
    std::vector<environment::PlateView> views;
    std::vector<FrameNumber> numbers;
    if (together) {
        for (const PlateSamples::Frame& sample : samples) {
            views.push_back(viewOf(sample.pixels, sample.number));
            numbers.push_back(sample.number);
        }
    }
    light = std::make_shared<ShotLight>(settings, views, wanted_.panorama, kept_, shot.inMemory);
    lightSource = !settings.env.empty() ? settings.env
                  : together
                      ? fmt::format("plate, frame{} {}", numbers.size() == 1 ? "" : "s", formatFrameRange(numbers))
                      : "plate, each frame" + (whyNot.empty() ? whyNot : ": " + whyNot);
    log::detail("light from the {}", lightSource);
}

}  // namespace virga::shot
