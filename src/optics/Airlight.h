// Airlight: the glow of a lamp in rain or mist, light that is scattered once on its way to the camera.
//
// Sun, Ramamoorthi, Narasimhan & Nayar 2005, "A Practical Analytic Single Scattering Model for Real Time Rendering",
// ACM Trans. Graph. 24(3): an isotropic point light in a homogeneous medium that scatters isotropically and does not
// absorb. With beta the extinction coefficient [1/m], s and h the lamp's places along and off the view ray, d(x) its
// distance from the point x of the ray, and D the surface,
//   L = beta / (4 pi) integral_0^D exp(-beta (x + d)) / d^2 dx          per unit of radiant intensity [1/m^2]
//     = A0 integral_(gamma/2)^v exp(-A1 tan xi) d xi,   A1 = beta h,   A0 = beta exp(-beta s) / (2 pi h).
// The paper takes the integral as a difference of two table values F, which loses every digit where they are close, and
// A0 grows without bound on the ray. Here h tan xi = l - s + y, where l is the lamp's distance and y the detour that
// light takes by way of x, more than l:
//   L = beta / (2 pi) exp(-beta l) integral_0^Y exp(-beta y) / (h^2 + (l - s + y)^2) dy,   Y = D + d(D) - l.
// Every factor is positive, finite on the ray, and as exact as its arguments.
//
// Left out: light scattered twice or more (noticed from an optical depth of 1), the forward lobe of drops, shadows.
#pragma once

namespace virga::optics {

/// L [1/m^2] as above: times a radiant intensity [W/sr] a radiance [W/(m^2 sr)].
/// along       s [m], the lamp's place along the ray; negative behind the camera
/// across      h [m], its distance from the ray, >= 0. 0 with the lamp on the ray between camera and surface, or in
///             the camera: infinite, as the model has it; give a lamp's radius as the least h
/// distance    D [m] along the ray to the surface, >= 0; infinity: none
/// extinction  beta [1/m], >= 0; 0 gives 0
/// Gauss-Legendre panels over log(1 + y / scale), up to exp(-45): relative error < 1e-13, about a hundred exponentials.
/// Does not throw. What a shader takes is airlightQuadrature, in optics/AirlightQuadrature.h.
double airlight(double along, double across, double distance, double extinction);

}  // namespace virga::optics
