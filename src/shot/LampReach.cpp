#include "shot/LampReach.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>
#include <utility>

#include "optics/DropTransfer.h"

namespace virga::shot {
namespace {

/// No less than 0 and no more than the distance of a place in camera axes to the part of space that the picture shows:
/// how far it is outside of the one of its six sides that it is farthest from.
double distanceToView(const glm::dvec3& place, const camera::Projection& projection, double far_m)
{
    const camera::Borders view = camera::bordersOf(projection);
    const double depth = -place.z;
    const double outside[] = {(place.x - view.right * depth) / std::hypot(1.0, view.right),
                              (view.left * depth - place.x) / std::hypot(1.0, view.left),
                              (place.y - view.top * depth) / std::hypot(1.0, view.top),
                              (view.bottom * depth - place.y) / std::hypot(1.0, view.bottom),
                              depth - far_m,
                              -depth,
                              0.0};
    return *std::max_element(std::begin(outside), std::end(outside));
}

/// The most light that the lamp adds to a pixel.
double mostLight(const SceneLight& lamp, const particles::Exposure& exposure, double far_m, double extinction_1_m,
                 double greatestTransfer_1_sr, double dropWay_m)
{
    const double brightest = std::max({lamp.intensity.x, lamp.intensity.y, lamp.intensity.z});
    if (!(brightest > 0)) return 0;
    double distance = std::numeric_limits<double>::infinity();
    for (const camera::Pose* pose : {&exposure.poseAtOpen, &exposure.poseAtClose}) {
        const glm::dvec3 inCamera = glm::transpose(pose->worldFromCamera) * (lamp.position - pose->position);
        distance = std::min(distance, distanceToView(inCamera, exposure.projection, far_m));
    }
    // A drop's stroke may begin or end in view, and its middle has the light; wide ones reach in from the side.
    distance -= glm::length(exposure.poseAtClose.position - exposure.poseAtOpen.position) + dropWay_m + 0.1;
    if (distance <= 0) return std::numeric_limits<double>::infinity();
    const double share = greatestTransfer_1_sr + 1 / (4 * std::numbers::pi);
    return brightest * share * std::exp(-extinction_1_m * distance) / (distance * distance);
}

}  // namespace

std::vector<float> ringTransferTable()
{
    constexpr int steps = 256;
    std::vector<float> table(3 * steps);
    for (std::size_t c = 0; c < 3; ++c) {
        const optics::RingTransfer ring({.index = optics::waterIndex[c]});
        for (int i = 0; i < steps; ++i)
            table[3 * std::size_t(i) + c] =
                float(ring.mean((i + 0.5) * std::numbers::pi / steps, 0.5 * std::numbers::pi / steps));
    }
    return table;
}

std::vector<SceneLight> lampsInReach(const std::vector<SceneLight>& lamps, const particles::Exposure& exposure,
                                     double far_m, double extinction_1_m, double greatestTransfer_1_sr,
                                     double dropWay_m)
{
    std::vector<std::pair<double, std::size_t>> byLight;
    for (std::size_t i = 0; i < lamps.size(); ++i)
        byLight.emplace_back(mostLight(lamps[i], exposure, far_m, extinction_1_m, greatestTransfer_1_sr, dropWay_m), i);
    std::sort(byLight.begin(), byLight.end());
    std::vector<bool> isSeen(lamps.size(), true);
    double unseen = 0;
    for (const auto& [light, i] : byLight) {
        unseen += light;
        if (unseen > unseenLampLight) break;
        isSeen[i] = false;
    }
    std::vector<SceneLight> seen;
    for (std::size_t i = 0; i < lamps.size(); ++i)
        if (isSeen[i]) seen.push_back(lamps[i]);
    return seen;
}

}  // namespace virga::shot
