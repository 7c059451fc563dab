// Turning functions on the sphere without projecting them again.
#pragma once

#include <glm/mat3x3.hpp>

#include "sh/Harmonics.h"

namespace virga::sh {

/// The function turned by `rotation` (orthonormal, determinant 1): what was seen along d is seen along rotation * d. So
/// for a camera in whose axes the light is wanted, `rotation` is cameraFromWorld.
///
/// Exact: bands turn each by themselves. A turn about the vertical mixes cos(m p) with sin(m p) alone; any other turn
/// is Z(a) Y(b) Z(c), and Y(b) = Z(-90) Y(-90) Z(b) Y(90) Z(90), so that Wigner's d is needed at 90 degrees only, where
/// Trapani & Navaza's recurrence (2006, Acta Cryst. A62, 262) is stable to order 1024 and beyond. about order^3
/// products.
Harmonics rotated(const Harmonics& harmonics, const glm::dmat3& rotation);

}  // namespace virga::sh
