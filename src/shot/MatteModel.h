// In which values and for which colour of rain the mattes are solved, and what they are in linear light.
#pragma once

#include <array>

#include "core/Image.h"
#include "matte/RainExtraction.h"
#include "matte/RainStrokes.h"
#include "shot/ModelSpace.h"

namespace virga::shot {

class MatteModel {
public:
    MatteModel() = default;
    /// Colours in the values of the model: `color` is the C that it is solved with, `shown` the one that mattes are
    /// made for. They differ where light was added, which has no C: solved with one far beyond white, mattes would be
    /// next to nothing.
    MatteModel(ModelSpace space, const std::array<float, 3>& color, const std::array<float, 3>& shown);

    ModelSpace space() const { return space_; }
    /// `shown`, in linear light.
    const std::array<float, 3>& linearColor() const { return linearColor_; }

    /// The alpha that lays the shown C over linear light as the model lays its own over its own values; least squares
    /// over the channels.
    ImageF toLinearAlpha(const ImageF& alpha, const ImageF& scene) const;

    /// How strokes are found in linear alphas of this solution: their direction and their noise.
    matte::RainStrokeOptions strokeOptions(const matte::Extraction& found) const;

private:
    ModelSpace space_ = ModelSpace::Linear;
    std::array<float, 3> color_{};  // in the values of the model
    std::array<float, 3> linearColor_{};
    bool isRecoloured_ = false;
};

}  // namespace virga::shot
