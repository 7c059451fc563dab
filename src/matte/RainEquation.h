// Rain over a still scene: I = (1 - alpha) S + alpha C, and what it costs to explain footage with it.
// Wang, Lin, Fang, Xie, Zheng, Zhang, "Real-time photorealistic rain", 2006, Eq. (1):
//
//   F(S, alpha) = sum over pixels, channels, frames of w (I - (1 - alpha) S - alpha C)^2
//               + lambda sum |grad S|^2 + mu sum (grad alpha . D0)^2  [+ 2 eta sum q alpha]
//
// The paper has w = 1. Ours is a trust in each pixel of each frame, 0..1: where something moves that is not rain, the
// still scene explains nothing, and alpha is carried on along the stroke from where it is seen. q says where rain is
// less (or more) likely than elsewhere, and is 1 unless something is known of that.
// Eq. (1) alone is ill-posed: its data term does not change under S - C -> s (S - C), 1 - alpha -> (1 - alpha) / s.
// 0 <= alpha <= 1 inside the solve and the linear cost eta on alpha make it well-posed; both are ours, not the paper's.
//
// Pictures are linear (or whatever the model is meant to hold in), 1 or 3 channels, all of one size. Differences are
// forward ones; one that leaves the picture is 0. D0 = (sin slant, cos slant), x right, y down: positive slant = the
// lower end of a stroke lies to the right. Frames and lines run in parallel; the result does not depend on how.
// Steps with a tolerance of 1e-5 or more go in float, of less in double. F is summed in float along a row, then in
// double.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::matte {

struct RainTerms {
    std::array<float, 3> color = {1, 1, 1};  // C, in the units of the footage
    double lambda = 1.0 / 20.0;              // >= 0, smoothness of the scene
    double mu = 1.0 / 4.0;                   // >= 0, smoothness of alpha along the rain
    double eta = 0.0;                        // >= 0, linear cost of alpha, as 2 eta sum(q alpha)
    double slant = 0.0;                      // [rad], -pi/2..pi/2
    bool bounded = true;                     // 0 <= alpha <= 1
};

/// What F explains. Views of pictures that somebody else holds.
struct Footage {
    std::span<const ImageF> frames;
    std::span<const ImageF> trust = {};  // w, one a frame, 1 channel, 0..1; none = 1 everywhere
    std::span<const ImageF> cost = {};   // one a frame, 1 channel, >= 0: multiplies eta; none = 1 everywhere

    /// The trust in pixel i of frame k.
    double trusted(std::size_t k, std::size_t i) const { return trust.empty() ? 1.0 : double(trust[k].data()[i]); }
};

/// The four sums of F, in double.
struct RainObjective {
    double data = 0, scene = 0, rain = 0, cost = 0;
    double total() const { return data + scene + rain + cost; }
};

RainObjective rainObjective(const Footage& footage, const ImageF& scene, std::span<const ImageF> alphas,
                            const RainTerms& terms);

/// The scene that minimises F for these alphas, in place: conjugate gradients from what `scene` holds, until the
/// residual is below `tolerance` of the right side (or 500 steps; F never rises). A pixel covered, or not trusted, in
/// all frames takes its neighbours' colour through lambda; with lambda = 0 it keeps what it has.
void solveScene(const Footage& footage, std::span<const ImageF> alphas, const RainTerms& terms, ImageF& scene,
                double tolerance = 1e-7);

/// The alphas that minimise F for this scene, in place; what they hold is the start. Without bounds: conjugate
/// gradients, preconditioned with the columns along the rain, until the residual is below `tolerance` of the right
/// side. With bounds: those columns in turn, each exactly (BoundedLines.h), until none would follow its neighbours by
/// more than about `tolerance`; within ten times that of the minimum (tests/matte/alternation_test.cpp). Where the rain
/// is vertical or level one turn is exact; F never rises. Where C = S along a whole line alpha cannot be seen: it stays
/// bounded, and with eta > 0 it goes to 0.
///
/// Lines sheared along the rain, one tridiagonal system each, would need no turns; but cut from whole pixels they put
/// alpha further from the truth at 7 degrees, RMS 0.0085 beside 0.0060 with mu = 1/4 (0.0063 beside 0.0057 where each
/// has the best mu of five), on the one reference case that is slanted.
void solveAlpha(const Footage& footage, const ImageF& scene, const RainTerms& terms, std::span<ImageF> alphas,
                double tolerance = 1e-7);

}  // namespace virga::matte
