// One exposure as the reference renders it: what docs/design.md, "Image formation", needs, in its own words and in
// double precision. World axes and signs: docs/conventions.md.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "core/Image.h"
#include "grade/ColorTransfer.h"
#include "grade/Darken.h"
#include "matte/StrokeAtlas.h"
#include "particles/RainField.h"
#include "rainfall/DropSizes.h"

namespace virga::reference {

using ImageD = Image<double>;

/// Which drops there are and what a camera makes of one.
struct Rain {
    const particles::RainField* field = nullptr;  ///< nothing: no drop
    /// Near and far hold the drops as they hold the renderer's: the nearer end of the way and the middle of it.
    particles::Visibility visibility;
    /// Every drop of the field between near and far; else those whose stroke reaches the threshold, which are the ones
    /// that the renderer draws. Drops under the field's smallest class (0.3 mm) are in no field and always fog.
    bool allDrops = true;
    /// The sizes that the field was made from, if some of its strokes are thinned out: the mean of those is a veil.
    const rainfall::DropSizes* thinnedSizes = nullptr;
    double opacity = 1;  ///< multiplies what drops cover
    /// Mattes that drops wear; nothing: drops are plain discs.
    const matte::StrokeAtlas* atlas = nullptr;
    double aperture_m = 0, inverseFocus_1_m = 0;  ///< of the lens; 0, ...: everything is in focus
    /// Samples along the edge of a pixel: a drop is sampled samples^2 times for each pixel that its stroke touches.
    int samples = 16;
};

/// A lamp that shines alike in all directions.
struct Lamp {
    glm::dvec3 position;   ///< world [m]
    glm::dvec3 intensity;  ///< radiance times area [m^2]
    double radius_m = 0.05;
};

/// What the air does.
struct Air {
    /// Of the fog out to a depth [m], infinity too; empty: there is none.
    std::function<double(double depth_m)> opticalDepth;
    double openDepth_m = 50;          ///< of a pixel whose depth nobody knows
    std::optional<glm::dvec3> color;  ///< of the fog; nothing: the mean of what drops return and of what is behind
    double lampExtinction_1_m = 0;    ///< near the lamps
};

/// Radiance along directions in the world (length 1).
using Radiance = std::function<std::vector<glm::dvec3>(std::span<const glm::dvec3> directions)>;

struct Scene {
    particles::Exposure exposure;
    double focalAtClose_px = 0;
    Rain rain;
    Air air;
    std::vector<Lamp> lamps;
    Radiance dropLight;  ///< what a drop returns; needed if there is rain or fog
    Radiance behind;     ///< what the fog scatters straight on; needed if there is fog
    grade::Darkening darkening;
    const grade::ColorLut* colorTransfer = nullptr;
    double blur_px = 0, blurDistance_m = 50;  ///< sigma at infinity; depth at which it has reached 63 %
};

}  // namespace virga::reference
