#include "shot/CameraTrack.h"

#include <array>
#include <string_view>
#include <utility>

#include "camera/RenderMatrices.h"
#include "core/Error.h"
#include "core/Log.h"
#include "core/Parallel.h"
#include "io/ImageFile.h"

namespace virga::shot {
namespace {

/// The choice that the settings' table allows by this name.
template <class Choice, std::size_t N>
Choice choiceOf(std::string_view word, const std::array<std::pair<std::string_view, Choice>, N>& choices)
{
    for (const auto& [name, choice] : choices)
        if (name == word) return choice;
    return choices[0].second;
}

/// Of a file that cannot be read none: reading its pixels will say why.
camera::RenderMatrices matricesOf(const std::string& path)
{
    try {
        const io::ImageHeader header = io::readImageHeader(path);
        return {io::matrixAttribute(header, "worldToCamera"), io::matrixAttribute(header, "worldToNDC")};
    } catch (const Error&) {
        return {};
    }
}

}  // namespace

camera::TrackOptions trackOptionsOf(const Settings& s)
{
    using camera::RotationOrder;
    using camera::WorldUp;
    static constexpr std::array<std::pair<std::string_view, WorldUp>, 4> ups = {
        {{"y", WorldUp::Y}, {"z", WorldUp::Z}, {"-y", WorldUp::MinusY}, {"-z", WorldUp::MinusZ}}};
    static constexpr std::array<std::pair<std::string_view, RotationOrder>, 6> orders = {{{"zxy", RotationOrder::ZXY},
                                                                                          {"xyz", RotationOrder::XYZ},
                                                                                          {"xzy", RotationOrder::XZY},
                                                                                          {"yxz", RotationOrder::YXZ},
                                                                                          {"yzx", RotationOrder::YZX},
                                                                                          {"zyx", RotationOrder::ZYX}}};
    camera::TrackOptions options;
    options.scale = s.cameraScale;
    options.up = choiceOf(s.cameraUp, ups);
    options.frameOffset = s.cameraOffset;
    options.rotationOrder = choiceOf(s.cameraOrder, orders);
    options.matrix.byColumns = s.cameraLayout == "column";
    options.matrix.worldToCamera = s.cameraMatrix == "world-to-camera";
    options.matrix.looksAlongZ = s.cameraAxes == "opencv";
    return options;
}

bool hasCameraFile(const Settings& settings)
{
    return !settings.camera.empty() && settings.camera != "plate" && settings.camera != "none";
}

camera::Track readCameraTrack(const Settings& settings)
{
    if (!hasCameraFile(settings)) return {};
    camera::TrackReading reading = camera::readTrack(settings.camera, trackOptionsOf(settings));
    for (const std::string& note : reading.notes) log::warning("{}", note);
    return std::move(reading.track);
}

std::optional<camera::TrackReading> readPlateCamera(const Settings& settings, const io::PlateInfo& plate)
{
    const bool isAsked = settings.camera == "plate";
    if (!isAsked && !settings.camera.empty()) return std::nullopt;
    const auto pathOf = [&](FrameNumber frame) {
        return plate.isStill ? plate.path : io::framePath(plate.path, frame);
    };
    const auto lack = [&]() -> std::optional<camera::TrackReading> {
        if (!isAsked) return std::nullopt;
        throw Error(ErrorCode::Input,
                    "--camera plate: '{}' has no camera in its headers (worldToCamera or worldToNDC of EXR files)",
                    plate.path);
    };
    if (plate.isMovie || plate.frames.empty()) return lack();
    if (matricesOf(pathOf(plate.frames.front())).empty()) return lack();

    std::vector<std::optional<camera::Pose>> found(plate.frames.size());
    parallelFor(0, std::ptrdiff_t(found.size()), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (auto i = std::size_t(first); i < std::size_t(last); ++i) {
            const std::string path = pathOf(plate.frames[i]);
            const camera::RenderMatrices matrices = matricesOf(path);
            if (!matrices.empty()) found[i] = camera::poseFromRenderMatrices(matrices, path);
        }
    });
    std::map<FrameNumber, camera::Pose> poses;
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i]) poses.emplace(plate.frames[i], *found[i]);
    camera::TrackReading reading;
    if (poses.size() < found.size())
        reading.notes.push_back(fmt::format("'{}': {} of {} frames have no camera in their header", plate.path,
                                            found.size() - poses.size(), found.size()));
    reading.track = camera::inOurWorld(camera::Track(std::move(poses)), trackOptionsOf(settings));
    reading.format = "camera in the plate's headers";
    return reading;
}

camera::Track shotTrack(const Settings& settings, const io::PlateInfo& plate)
{
    try {
        if (auto reading = readPlateCamera(settings, plate)) {
            log::info("the camera is the one in the headers of '{}' ({} frames); --camera none leaves it out",
                      plate.path, reading->track.poses().size());
            for (const std::string& note : reading->notes) log::warning("{}", note);
            return std::move(reading->track);
        }
    } catch (const Error& error) {
        if (settings.camera == "plate") throw;
        log::warning("{}; the camera in the plate's headers is left out", error.what());
    }
    return readCameraTrack(settings);
}

}  // namespace virga::shot
