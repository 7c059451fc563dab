// The light that drops return. A drop far smaller than the scene, seen along v (camera to drop), returns
//   L(v) = integral of D(angle(omega, v)) L_env(omega) d omega,
// a convolution on the sphere (optics/DropTransfer.h): band l of the environment times f_l. It is worked out once for
// an environment and baked to a small equirectangular map in WORLD orientation, so that a stroke costs one texture
// fetch.
//
//   default: C = radiance(v) + c (B - background(v)), B the plate's pixel behind the stroke. The boost c puts back what
//   the order leaves out and keeps energy: in a uniform world of radiance L both maps are L, at every order.
//
//   paper: C = radiance(v) + c B, c = 0.7. Wang et al. 2006, Eq. (2): order 3, unpolarised, nine terms, one index.
//
// Bright small lights ring in low orders. What rises over 8 times the mean is taken out of the environment
// (EnvironmentLights.h) and put through D itself, averaged over the extent of light and map pixel (LightLobes.h); the
// result is added to the same map. Where the split lies does not show: both ways are right to the tolerance.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "core/Image.h"
#include "environment/EnvironmentLights.h"
#include "environment/LightLobes.h"
#include "environment/Panorama.h"
#include "optics/DropTransfer.h"
#include "sh/Harmonics.h"
#include "sh/Panorama.h"

namespace virga::environment {

struct DropRadianceOptions {
    static constexpr int autoOrder = -1;
    static constexpr int maxOrder = 128;
    static constexpr int maxAutoOrder = 64;

    /// 0 to maxOrder, or autoOrder: the lowest whose left-out bands are under `tolerance`. Panoramas made from a plate
    /// are smooth and made anew for every frame: give them plateOrder, which needs no search and keeps the maps' size.
    int order = autoOrder;
    static constexpr int plateOrder = 12;

    /// What `background` is low-passed to: sameOrder for the boost, which puts back what the drops' own order leaves
    /// out; any other, or autoOrder (that which drops would need), for fog, which shows what is behind it at any order
    /// of the drops.
    static constexpr int sameOrder = -2;
    int backgroundOrder = sameOrder;

    /// Root mean square over all directions of what may be left out, over the mean radiance. For autoOrder, and for the
    /// extents of lights.
    double tolerance = 0.005;

    bool paper = false;  ///< Wang et al.'s own arithmetic: order 3 unless `order` says otherwise, no lights taken out
    bool lights = true;  ///< take bright small lights out of the harmonics; costs 0.1 s when the baker is made
    double lightThreshold = 8;  ///< see TakeLightsOptions; over 1
    std::array<double, 3> index{optics::waterIndex[0], optics::waterIndex[1], optics::waterIndex[2]};
};

/// Maps for the shader, and what they were made from. Sample both with wrap in x, clamp in y, bilinear, no mipmaps;
/// place of a world direction as in sh::panoramaPlace().
struct DropRadiance {
    ImageF radiance;    ///< RGB, >= 0 (but in paper mode as the harmonics have it)
    ImageF background;  ///< RGB, >= 0, of a size of its own: the environment itself (without the lights) low-passed to
                        ///< backgroundOrder, by a Gaussian window over the bands, as a sharp cut rings
    bool paper = false;

    int order = 0;
    /// Root mean square error over the mean radiance: of the order, bounded by the energy of the bands left out, and of
    /// the lights' extents, estimated (EnvironmentLights.h).
    double remainder = 0;
    std::vector<Light> lights;
    sh::Harmonics response;  ///< the harmonic part of `radiance`
};

/// Made once for given options, then used for any number of environments from any thread.
class DropRadianceBaker {
public:
    /// Throws Error(InvalidArgument) for an order, a tolerance or an index out of range.
    explicit DropRadianceBaker(const DropRadianceOptions& options = {});

    /// Deterministic, also across thread counts.
    DropRadiance bake(const Panorama& panorama) const;

    /// L(v) without the maps' pixels: harmonics summed in double precision, lights through D averaged over their own
    /// extent (at least 1/8 degree to either side) alone. What tests and the reference renderer compare the maps with.
    glm::dvec3 exactly(const DropRadiance& radiance, const glm::dvec3& direction) const;

    const DropRadianceOptions& options() const { return options_; }

private:
    DropRadianceOptions options_;
    std::vector<double> factor_[3];    // f_l for R, G, B, of the bands that are looked at
    std::optional<LightLobes> lobes_;  // if lights are taken out
};

using sh::sampleMap;  ///< how the shader looks the maps up

}  // namespace virga::environment
