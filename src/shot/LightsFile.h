// The lamps of a scene, for `--lights`: a TOML file with one [[light]] for each.
//
//   [[light]]
//   name = "lamp by the door"         # optional
//   position = [-3.25, 4.4, -12.5]    # metres, world (docs/conventions.md)
//   radiance = [9.0, 5.94, 2.7]       # scene-linear, as the lamp's pixels would be in a plate that does not clip
//   radius_m = 0.16                   # of the sphere that shows as much of itself
//
// or, instead of `radiance` and `radius_m`, `intensity = [r, g, b]`, the radiant intensity in scene-linear units times
// square metres: radiance times the area that faces the camera, pi radius^2 for a sphere. From a plate: the sum of the
// lamp's pixels, less what is behind it, times distance^2 / (focal length in pixels)^2.
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace virga::shot {

/// A lamp that shines alike in all directions.
struct SceneLight {
    std::string name;      ///< may be empty
    glm::dvec3 position;   ///< world [m]
    glm::dvec3 intensity;  ///< scene-linear radiance times area [m^2], each >= 0
    double radius_m;       ///< of the lamp, at least 1 mm; 5 cm where the file gives an intensity without it
};

/// A frame takes this many.
constexpr std::size_t maxSceneLights = 16;

/// Reads the file; one without lights gives none. Throws Error(Input) naming the file, the line, the key, the value and
/// what is allowed.
std::vector<SceneLight> readLights(const std::string& path);

}  // namespace virga::shot
