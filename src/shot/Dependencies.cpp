#include "shot/Dependencies.h"

#include <algorithm>
#include <string_view>
#include <variant>

#include "core/Error.h"

namespace virga::shot {
namespace {

struct Row {
    std::string_view name;
    unsigned parts;
};

/// Every parameter, by group.
constexpr Row rows[] = {
    {"rate", RainPart},
    {"strokes", RainPart},
    {"drop-size", RainPart},
    {"speed", RainPart},
    {"wind", RainPart},
    {"gust", RainPart},
    {"turbulence", RainPart},
    {"opacity", RainPart},
    {"near", RainPart},
    {"far", RainPart},
    {"threshold", RainPart},
    {"thin", RainPart},
    {"seed", RainPart | MattesPart},
    {"mattes", MattesPart},

    {"shutter", TimePart},
    {"exposure", TimePart},
    {"fps", TimePart},
    {"fov", CameraPart},
    {"focus", RainPart},
    {"fstop", RainPart},
    {"sensor-width", RainPart},
    {"camera", CameraPart},
    {"camera-scale", CameraPart},
    {"camera-up", CameraPart},
    {"camera-offset", CameraPart},
    {"camera-order", CameraPart},
    {"camera-layout", CameraPart},
    {"camera-matrix", CameraPart},
    {"camera-axes", CameraPart},
    {"first-frame", TimePart},

    {"env", LightPart},
    {"env-yaw", LightPart},
    {"env-pitch", LightPart},
    {"env-gain", LightPart},
    {"env-order", LightPart},
    {"env-frames", LightPart},
    {"light-radiance", LightPart},
    {"sky", LightPart},
    {"background-boost", LightPart},
    {"paper", LightPart},
    {"lights", LampsPart},

    {"depth", DepthPart},
    {"depth-scale", DepthPart},
    {"depth-offset", DepthPart},
    {"depth-kind", DepthPart},
    {"depth-invert", DepthPart},
    {"depth-range", DepthPart},
    {"depth-baseline", DepthPart},
    {"depth-channel", DepthPart},
    {"depth-packing", DepthPart},
    {"depth-first-frame", DepthPart},
    {"depth-no-value", DepthPart},
    {"ground", CameraPart | DepthPart},
    {"fog", FogPart},
    {"fog-color", NoPart},
    {"fog-distance", FogPart},
    {"blur", NoPart},
    {"blur-distance", NoPart},
    {"splashes", NoPart},
    {"splash-size", NoPart},

    {"darken", NoPart},
    {"desaturate", NoPart},
    {"grade-from", TransferPart},
    {"grade-amount", TransferPart},

    {"ocio", LightPart | TransferPart},
    {"colorspace", NoPart},
    {"output-colorspace", NoPart},
    {"float", NoPart},
    {"codec", NoPart},
    {"quality", NoPart},
    {"pixel-format", NoPart},
    {"profile", NoPart},
    {"preset", NoPart},
    {"codec-options", NoPart},
    {"container", NoPart},
    {"reencode", NoPart},
    {"layer", NoPart},
    {"view", NoPart},
    {"stream", NoPart},
    {"deinterlace", NoPart},
    {"on-error", DepthPart},
};

}  // namespace

unsigned partsOf(const Parameter& parameter)
{
    const Row* row = std::find_if(std::begin(rows), std::end(rows),
                                  [&](const Row& r) { return r.name == std::string_view(parameter.name); });
    if (row == std::end(rows)) throw Error(ErrorCode::Internal, "--{}: nobody knows what depends on it", parameter.name);
    return row->parts;
}

unsigned withWhatBuildsOn(unsigned parts)
{
    // The density of --strokes and the share that is thinned out are those of the first frame's camera and exposure.
    if (parts & TimePart) parts |= RainPart;
    if (parts & CameraPart) parts |= RainPart | LightPart | DepthPart;
    if (parts & (RainPart | DepthPart)) parts |= FogPart;
    return parts;
}

unsigned partsThatDiffer(const Settings& before, const Settings& after)
{
    unsigned parts = NoPart;
    for (const Parameter& p : parameters()) {
        const bool differs = std::visit([&](auto member) { return !(before.*member == after.*member); }, p.member);
        if (differs) parts |= partsOf(p);
    }
    return withWhatBuildsOn(parts);
}

}  // namespace virga::shot
