#include "shot/CameraTrack.h"

#include <array>
#include <string_view>
#include <utility>

#include "core/Log.h"

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

camera::Track readCameraTrack(const Settings& settings)
{
    if (settings.camera.empty()) return {};
    camera::TrackReading reading = camera::readTrack(settings.camera, trackOptionsOf(settings));
    for (const std::string& note : reading.notes) log::warning("{}", note);
    return std::move(reading.track);
}

}  // namespace virga::shot
