// A homography between two frames, as alignFrames returns it and the warps take it. Pixels, and centres of pixels, as
// in docs/conventions.md; what the alignment computes with inside is PlaneTransform.
#pragma once

#include <array>

namespace virga::matte {

/// Row by row: (x, y) goes to ((m0 x + m1 y + m2) / w, (m3 x + m4 y + m5) / w), w = m6 x + m7 y + m8 > 0 [px].
struct Homography {
    std::array<double, 9> m = {1, 0, 0, 0, 1, 0, 0, 0, 1};

    /// Of a point; not finite where w is 0.
    std::array<double, 2> operator()(double x, double y) const;
    /// Scaled so that m8 is 1 where it can be. Of a singular one: the identity.
    Homography inverse() const;
};

}  // namespace virga::matte
