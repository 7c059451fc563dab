#include "shot/ScenePictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/Error.h"
#include "shot/AtlasFile.h"
#include "shot/LampReach.h"

namespace virga::shot {

/// Lamps that no drop of the shot is lit by need no sums and no part in the shaders. A camera that moves may come near
/// them: then each frame decides.
void ScenePictures::leaveOutLamps()
{
    if (ringTransfer_.empty()) ringTransfer_ = ringTransferTable();
    greatestTransfer_ = double(*std::max_element(ringTransfer_.begin(), ringTransfer_.end()));
    if (lamps.empty() || !plan.skips.passes || !track.isStatic()) return;
    if (!seenLamps(frameExposureAt(shot.firstFrame), greatestTransfer_).empty()) return;
    plan.features.lights = false;
    plan.leaveOut("lights", fmt::format("no light of '{}' reaches a drop", settings.lights));
}

/// After the scene's parts have been made: a renderer for them, unless the one that is there will do.
void ScenePictures::prepare(unsigned parts)
{
    statistics.lightSource = lightSource;
    for (const auto& [part, name] : {std::pair{RainPart, "rain"},
                                     {LightPart, "light"},
                                     {DepthPart, "depth"},
                                     {LampsPart, "lamps"},
                                     {TransferPart, "colour transfer"},
                                     {CameraPart, "camera"}})
        if (parts & part) ++statistics.made[name];
    if (parts & MattesPart) atlas = nullptr;
    if (parts & DepthPart) usedDepth = nullptr;
    if (parts & FogPart) tablesFocal_ = -1;
    if (parts & LightPart) hasLight_ = false;
    lastContent = 0;
    if (plan.isPassThrough()) return;
    if (plan.features.lights) leaveOutLamps();
    if (renderer && madeFor_ == plan.features && !(parts & (MattesPart | TransferPart))) return;
    if (plan.features.rain && !atlas)
        atlas = std::make_shared<const matte::StrokeAtlas>(
            settings.mattes.empty() ? builtInAtlas(std::uint32_t(settings.seed)) : loadAtlas(settings.mattes));
    const Window frame = drawn.isEmpty() ? frameWindow() : drawn;
    const matte::StrokeAtlas none;
    auto made = makePictureRenderer({frame.width, frame.height, plan.features, plan.features.rain ? *atlas : none, lut,
                                     ringTransfer_, options.device, options.shaderFolder, options.cacheFolder});
    renderer = std::move(made);
    madeFor_ = plan.features;
    ++statistics.made["renderer"];
    statistics.device = renderer->device();
    forgetWhatIsTold();
    drawn = frame;
}

void ScenePictures::forgetWhatIsTold()
{
    usedDepth = nullptr;
    farthestDepth.reset();
    tablesFocal_ = -1;
    hasLight_ = false;
    lastContent = 0;
}

ViewWindows ScenePictures::windowsFor(const View& view) const
{
    // As far as a Gaussian of the largest sigma is summed.
    const int blurReach = plan.features.blur ? int(std::ceil(3 * settings.blur_px * view.scale)) + 1 : 0;
    int splashReach = 0;
    if (plan.features.splashes) {
        // Droplets fly and crowns grow so far; on nothing nearer than a metre, or than a lower camera's ground.
        const double reach_m = 0.05 + 0.05 * settings.dropSize * settings.splashSize;
        const double nearest_m = settings.depth.empty() ? std::min(1.0, parseGround(settings.ground).height_m) : 1.0;
        const double focal = frameExposureAt(shot.firstFrame).projection.fullFocal_px() * view.scale;
        splashReach = int(std::ceil(std::min(4096.0, focal * reach_m / nearest_m)));
    }
    return windowsOf(view, frameAt(shot.width, shot.height, view.scale), blurReach, splashReach);
}

bool ScenePictures::needsWholePlate() const
{
    return (plan.features.light() && light && light->needsPlate()) ||
           (plan.features.depth && depth && depth->mayFollowPlate());
}

/// Makes the renderer's pictures those of a part of the frame.
bool ScenePictures::look(double newScale, const Window& newDrawn)
{
    if (newScale == scale_ && newDrawn == drawn) return true;
    ShotScene::look(newScale, newDrawn);
    if (newDrawn.width != drawn.width || newDrawn.height != drawn.height)
        renderer->resize(newDrawn.width, newDrawn.height);
    scale_ = newScale;
    drawn = newDrawn;
    usedDepth = nullptr;
    return false;
}

void ScenePictures::setLamps(const particles::Exposure& exposure)
{
    const std::vector<SceneLight> seen = seenLamps(exposure, greatestTransfer_);
    lampsInUse = seen.size();
    renderer->setLamps(fromCamera(seen, exposure));
}

void ScenePictures::setTables(const particles::Exposure& exposure)
{
    if (tablesFocal_ == exposure.projection.fullFocal_px()) return;
    tablesFocal_ = exposure.projection.fullFocal_px();
    tables = tablesFor(exposure);
    if (plan.features.fog) {
        statistics.fogExtinction_1_m = extinctionAround(exposure);
        renderer->setFogTable(tables.fog);
    }
    if (plan.features.veil) renderer->setVeilTable(tables.veil);
}

void ScenePictures::setDepth(FrameNumber frame, const particles::Exposure& exposure, ConstImageViewF plate,
                             bool isSamePlate)
{
    const auto now = depthAt(frame, exposure, plate, isSamePlate);
    if (now == usedDepth) return;
    renderer->setDepth(now->metres);
    farthestDepth.reset();
    if (plan.features.rain && plan.skips.behindDepth) farthestDepth.emplace(now->metres);
    statistics.depthCounts = now->counts;
    statistics.depthResampled = now->resampled;
    usedDepth = now;
}

void ScenePictures::setLight(const io::PlateFrame& plate, const ViewWindows& windows, bool isSamePlate)
{
    ImageF sampled;
    if (light->needsPlate()) {
        const ConstImageViewF whole = plate.rows ? ConstImageViewF() : wholeFrameIn(plate, windows);
        if (!plate.rows && whole.empty())
            throw Error(ErrorCode::InvalidArgument,
                        "frame {}: is lit by its own plate, of which all is needed, not a part", plate.number);
        sampled = plate.rows ? sampledForLight(*plate.rows) : sampledForLight(ImageRows(whole));
    }
    if (light->update(plate.number, viewOf(sampled, plate.number), isSamePlate) || !hasLight_)
        renderer->setDropRadiance(light->radiance(), light->lowPassBackground());
    hasLight_ = true;
    statistics.lightOrder = light->order();
    statistics.lightRemainder = light->remainder();
    statistics.lightCount = light->lightCount();
}

/// Empty if the plate is a part of it.
ConstImageViewF ScenePictures::wholeFrameIn(const io::PlateFrame& plate, const ViewWindows& windows)
{
    const Window frame = windows.frame;
    if (plate.pixels.empty() || !windows.plate.contains(frame)) return {};
    return {plate.pixels.pixel(frame.x - windows.plate.x, frame.y - windows.plate.y), frame.width, frame.height,
            plate.pixels.channels(), std::ptrdiff_t(plate.pixels.width()) * plate.pixels.channels()};
}

}  // namespace virga::shot
