// Reflection at a smooth interface between two transparent media. Fresnel 1823; Hecht & Zajac 1974, section 4.6.
#pragma once

namespace virga::optics {

/// Power reflectances for light polarised across (s) and in (p) the plane of incidence, each in [0, 1].
struct Fresnel {
    double s, p;
    double mean() const { return 0.5 * (s + p); }  ///< unpolarised light
};

/// cosIncidence      cosine of the angle between ray and normal in the medium that the light comes from, in [0, 1]
/// relativeIndex     n of the medium beyond over n of the medium before, > 0; air to water 1.333, water to air 1/1.333
/// Transmittance is 1 minus reflectance. Past the critical angle both are 1. By reversibility the reflectances from the
/// other side, along the refracted ray, are the same. Does not throw.
Fresnel fresnel(double cosIncidence, double relativeIndex) noexcept;

/// Angle of incidence [rad] at which p is not reflected. Brewster 1815.
double brewsterAngle(double relativeIndex) noexcept;

/// Angle of refraction at grazing incidence [rad], relativeIndex >= 1: beyond it light does not leave the water.
double criticalAngle(double relativeIndex) noexcept;

}  // namespace virga::optics
