#include "shot/EnvironmentColor.h"

#include <algorithm>
#include <cmath>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "environment/DropRadiance.h"

namespace virga::shot {
namespace {

constexpr int directions = 8;  // across and down the view

}  // namespace

std::array<double, 3> environmentColor(const ImageF& plate, double horizontalFov)
{
    ImageF rgb(plate.width(), plate.height(), 3);
    for (std::size_t i = 0; i < rgb.size(); ++i)
        rgb.data()[i] = std::max(0.0f, plate.channels() == 3 ? plate.data()[i] : plate.data()[i / 3]);
    environment::DropRadianceOptions options;
    options.order = environment::DropRadianceOptions::plateOrder;
    options.lights = false;
    const environment::DropRadianceBaker baker(options);
    const environment::DropRadiance light =
        baker.bake(environment::panoramaFromPlate(rgb, horizontalFov, glm::dmat3(1.0)));
    const double right = std::tan(horizontalFov / 2), up = right * plate.height() / plate.width();
    std::array<double, 3> mean{};
    for (int j = 0; j < directions; ++j)
        for (int i = 0; i < directions; ++i) {
            const glm::dvec3 view(right * (2.0 * (i + 0.5) / directions - 1), up * (1 - 2.0 * (j + 0.5) / directions),
                                  -1.0);
            const auto seen = baker.exactly(light, glm::normalize(view));
            for (int c = 0; c < 3; ++c) mean[std::size_t(c)] += seen[c] / (directions * directions);
        }
    return mean;
}

}  // namespace virga::shot
