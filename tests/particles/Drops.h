// Drops of a list of cells, one by one, and what a picture shows of them: the slow twin of pass_emit_strokes.comp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <unordered_map>
#include <vector>

#include "particles/CellHash.h"
#include "particles/RainField.h"

namespace virga::particles::test {

struct SeenDrop {
    std::uint64_t cell = 0;  // hash of (seed, class, i, j, k)
    std::uint32_t index = 0, dropClass = 0;
    glm::dvec3 open, close;  // from the camera at open and at close, world axes [m]
    double diameter = 0;     // [m]
    double rank = 0;

    std::uint64_t id() const { return mix(cell ^ mix(index)); }
};

inline SeenDrop dropOf(const CellList& list, const shared::Cell& cell, std::uint32_t index)
{
    const shared::Drop drop = shared::dropInCell(cell, list.classes[cell.key.z], list.waves[0], list.waves[1],
                                                 list.waves[2], list.waves[3], index);
    return {cell.key.x | std::uint64_t(cell.key.y) << 32,
            index,
            cell.key.z,
            glm::dvec3(drop.open),
            glm::dvec3(drop.close),
            double(drop.diameter),
            double(drop.rank)};
}

inline std::vector<SeenDrop> dropsOf(const CellList& list)
{
    std::vector<SeenDrop> drops;
    drops.reserve(list.drops);
    for (std::size_t c = 0; c < list.cells.size(); ++c)
        for (std::uint32_t i = 0; i < list.dropsIn(c); ++i) drops.push_back(dropOf(list, list.cells[c], i));
    return drops;
}

inline std::unordered_map<std::uint64_t, SeenDrop> byId(const std::vector<SeenDrop>& drops)
{
    std::unordered_map<std::uint64_t, SeenDrop> map;
    for (const SeenDrop& drop : drops) map[drop.id()] = drop;
    return map;
}

inline glm::dvec3 inCamera(const camera::Pose& pose, const glm::dvec3& fromCamera)
{
    return glm::transpose(pose.worldFromCamera) * fromCamera;
}

/// Whether a segment meets the rectangle [-grow, width + grow] x [-grow, height + grow]. Liang and Barsky 1984.
inline bool crosses(const glm::dvec2& a, const glm::dvec2& b, double width, double height, double grow)
{
    double first = 0, last = 1;
    const glm::dvec2 way = b - a, size(width, height);
    for (int axis = 0; axis < 2; ++axis) {
        if (way[axis] == 0) {
            if (a[axis] < -grow || a[axis] > size[axis] + grow) return false;
            continue;
        }
        const double in = (-grow - a[axis]) / way[axis], out = (size[axis] + grow - a[axis]) / way[axis];
        first = std::max(first, std::min(in, out));
        last = std::min(last, std::max(in, out));
    }
    return first <= last;
}

inline double depthOf(const SeenDrop& drop, const Exposure& exposure)
{
    return -0.5 * (inCamera(exposure.poseAtOpen, drop.open).z + inCamera(exposure.poseAtClose, drop.close).z);
}

/// shared::drawnShare of it.
inline double drawnShareOf(const SeenDrop& drop, double speed, const Exposure& exposure, const Visibility& visibility)
{
    return double(shared::drawnShare(float(depthOf(drop, exposure)), float(drop.diameter),
                                     float(speed * exposure.duration_s), float(exposure.projection.focal_px),
                                     float(visibility.thin)));
}

/// Whether the drop's stroke touches a pixel. slack [px]: by how much it must reach into the picture.
/// aperture [m] and 1 / focus [1/m] widen it as the lens does.
inline bool isVisible(const SeenDrop& drop, double speed, const Exposure& exposure, const Visibility& visibility,
                      double slack = 0, double aperture = 0, double inverseFocus = 0)
{
    const glm::dvec3 open = inCamera(exposure.poseAtOpen, drop.open);
    const glm::dvec3 close = inCamera(exposure.poseAtClose, drop.close);
    const double depth = -0.5 * (open.z + close.z);
    if (std::min(-open.z, -close.z) < visibility.near_m || depth > visibility.far_m) return false;
    const double focal = exposure.projection.focal_px;
    if (depth > double(shared::visibleDepth(float(drop.diameter), float(speed * exposure.duration_s), float(focal),
                                            float(visibility.threshold))))
        return false;
    const double share = drawnShareOf(drop, speed, exposure, visibility);
    if (drop.rank >= share * share) return false;
    const double width = focal * drop.diameter / depth;
    const double confusion = focal * aperture * std::abs(1 / depth - inverseFocus);
    return crosses(camera::project(exposure.projection, open).px, camera::project(exposure.projection, close).px,
                   exposure.projection.width, exposure.projection.height,
                   0.5 * std::max(1.0, std::hypot(width, confusion)) - slack);
}

/// Whether a place given from the camera is inside the frustum from near to far.
inline bool isInside(const glm::dvec3& fromCamera, const Exposure& exposure, double near, double far)
{
    const glm::dvec3 p = inCamera(exposure.poseAtOpen, fromCamera);
    const double depth = -p.z, tanX = 0.5 * exposure.projection.width / exposure.projection.focal_px,
                 tanY = 0.5 * exposure.projection.height / exposure.projection.focal_px;
    return depth >= near && depth <= far && std::abs(p.x) <= tanX * depth && std::abs(p.y) <= tanY * depth;
}

}  // namespace virga::particles::test
