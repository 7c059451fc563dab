// libFuzzer's entry to the readers of camera tracks: any text is a track of finite poses, or Error(Input).
// The first byte says how the text is read; a COLMAP model is two texts with a zero byte between. Also driven without
// libFuzzer, by tests/camera/track_mutation_test.cpp.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "camera/ColmapTrack.h"
#include "camera/TrackFile.h"
#include "core/Error.h"

namespace {

using namespace virga;

camera::Track trackOf(std::uint8_t choice, std::string_view text)
{
    if ((choice & 1) != 0) {
        const std::size_t cut = std::min(text.find('\0'), text.size());
        return camera::parseColmap(text.substr(0, cut), text.substr(std::min(cut + 1, text.size())), "model").track;
    }
    camera::TrackOptions options;
    options.matrix = {(choice & 2) != 0, (choice & 4) != 0, (choice & 8) != 0};
    options.up = camera::WorldUp(choice >> 4 & 3);
    options.rotationOrder = camera::RotationOrder((choice >> 4) % 6);
    return camera::parseTrack(text, "track", options).track;
}

bool isFinite(const camera::Pose& pose)
{
    bool isFine = !pose.verticalFov || (*pose.verticalFov > 0 && *pose.verticalFov < 3.15);
    for (int i = 0; i < 3; ++i) {
        isFine = isFine && std::isfinite(pose.position[i]);
        for (int j = 0; j < 3; ++j) isFine = isFine && std::abs(pose.worldFromCamera[i][j]) < 1 + 1e-9;
    }
    return isFine;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    try {
        const camera::Track track = trackOf(data[0], {reinterpret_cast<const char*>(data) + 1, size - 1});
        if (track.empty()) std::abort();
        for (const auto& [frame, pose] : track.poses())
            if (!isFinite(pose)) std::abort();
    } catch (const Error& error) {
        if (error.code() != ErrorCode::Input || std::string_view(error.what()).empty()) std::abort();
    }
    return 0;
}
