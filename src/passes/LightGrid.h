#pragma once

#include <numbers>

namespace virga::passes {

constexpr int coarsestLightGrid = 16;

/// Pixels from one node of the light grid to the next: 16, 8 or 4, the first in which the radiance map moves on by no
/// more than a pixel of its own. Maps of smooth light are coarse and so are their grids; a sun's rainbow has a fine map
/// and asks for a fine grid.
inline int lightGridStep(int mapWidth, float focal_px)
{
    constexpr int finest = 4;
    const float mapPixel = 2 * std::numbers::pi_v<float> / float(mapWidth);  // [rad]
    int step = coarsestLightGrid;
    while (step > finest && float(step) / focal_px > mapPixel) step /= 2;
    return step;
}

}  // namespace virga::passes
