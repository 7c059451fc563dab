// In which values rain is laid over a scene: linear light, as optics has it, or the codes of a display, as whoever
// added rain to finished footage has it, and in which the noise of 8-bit footage is even.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/Image.h"

namespace virga::shot {

enum class ModelSpace { Linear, Display };

/// "linear" or "display"; nothing for any other word.
std::optional<ModelSpace> modelSpaceNamed(const std::string& name);
const char* nameOf(ModelSpace space);

/// Scene-linear light -> values of the model, and back; in place. Display: the sRGB curve (io/Curve.h).
void toModel(ImageF& linear, ModelSpace space);
void fromModel(ImageF& values, ModelSpace space);

/// How much the noise depends on brightness: the standard deviation, over eight steps of brightness, of the logarithm
/// of the noise on the dark side of the scene. Least squares take noise for even: the space in which it is most so is
/// the one that the model fits best. Nothing if less than three steps show any noise (one frame, clean or clipped
/// footage).
std::optional<double> noiseUnevenness(std::span<const ImageF> frames);

}  // namespace virga::shot
