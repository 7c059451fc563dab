// The free oscillations of a falling drop. They bead the streak that the drop draws during an exposure.
#pragma once

#include <cmath>
#include <numbers>

namespace virga::optics {

/// Water against air at 20 C.
struct Water {
    static constexpr double surfaceTension = 0.0728;  ///< [N/m]
    static constexpr double density = 998.2;          ///< [kg/m^3]
};

/// Frequency [Hz] of oscillation mode n >= 2 of a drop of `diameter` [m] > 0:
///   f_n = sqrt(n (n-1) (n+2) sigma / (rho r^3)) / (2 pi).
/// Rayleigh 1879, "On the capillary phenomena of jets", Proc. R. Soc. 29: 71-97. Mode 2 swings between oblate and
/// prolate, mode 3 is pear-shaped; Garg & Nayar 2006 find these two in streaks (as r = r0 (1 + A_2 sin(2 pi f_2 t)
/// P_2(cos theta) + A_3 sin(2 pi f_3 t) P_3^1(cos theta) cos phi), the second sideways).
/// Small amplitudes, no viscosity: within a few per cent for drops over 0.3 mm. Does not throw.
inline double oscillationFrequency(int mode, double diameter) noexcept
{
    const double radius = 0.5 * diameter;
    const double n = mode;
    return std::sqrt(n * (n - 1.0) * (n + 2.0) * Water::surfaceTension / (Water::density * radius * radius * radius)) /
           (2.0 * std::numbers::pi);
}

/// Rate [1/s] at which mode n dies away by viscosity, amplitude ~ exp(-rate t): (n-1)(2n+1) nu / r^2.
/// Lamb 1932, "Hydrodynamics", article 355; nu = 1.004e-6 m^2/s. The air keeps exciting what viscosity damps. Does not
/// throw.
inline double oscillationDamping(int mode, double diameter) noexcept
{
    constexpr double kinematicViscosity = 1.004e-6;  // [m^2/s], 20 C
    const double radius = 0.5 * diameter;
    return (mode - 1) * (2 * mode + 1) * kinematicViscosity / (radius * radius);
}

}  // namespace virga::optics
