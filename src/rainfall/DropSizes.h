// How many drops of which size a cubic metre of rain holds. Marshall & Palmer 1948, "The distribution of raindrops with
// size", J. Meteorology 5: 165-166:
//
//   N(D) = N0 exp(-Lambda D),   Lambda = 4.1 R^-0.21 /mm,   R the rain rate in mm/h.
//
// Their N0 = 8000 /(m^3 mm) with measured fall speeds gives 5 to 18 % more rain than R. Here N0 is what makes the rate
// that is asked for the rate that falls: the integral of pi/6 D^3 v(D) N(D) over all diameters, v from terminalSpeed().
//
// Diameters run from 0 to 8 mm (larger drops break up). The law is an average over many rains and was measured for
// D > 1 mm; real rain holds fewer drops under 0.5 mm than it says.
//
// Every function takes and gives SI units unless its name says otherwise, may be called from any thread, and answers an
// interval [d0, d1] cut to the supported diameters (an empty one: 0).
#pragma once

#include <functional>
#include <limits>

namespace virga::rainfall {

class DropSizes {
public:
    /// The largest drop that holds together [m], before the artist's multiplier.
    static constexpr double breakUpDiameter = 8e-3;

    /// rate_mm_h       0 to 1e6; 0 is no rain. Under 1e-6 the shape (Lambda) is that of 1e-6.
    /// sizeMultiplier  art direction, 0.01 to 100: every drop of diameter D becomes one of sizeMultiplier * D; their
    ///                 number stays, so what then falls differs from rate_mm_h; see impliedRate_mm_h().
    /// Throws Error(InvalidArgument) for anything else.
    explicit DropSizes(double rate_mm_h, double sizeMultiplier = 1.0);

    /// Marshall and Palmer's law as they wrote it: N0 = 8000 /(m^3 mm), and diameters without end (up to 60 / Lambda,
    /// beyond which nothing is left in double precision), so that moments are k! N0 / Lambda^(k+1). For comparison:
    /// impliedRate_mm_h() is not rate_mm_h(). Throws as above.
    static DropSizes marshallPalmer(double rate_mm_h);

    double rate_mm_h() const { return rate_; }
    double sizeMultiplier() const { return sizeMultiplier_; }
    bool empty() const { return intercept_ == 0.0; }

    double slope() const { return slope_; }                      ///< Lambda [1/m]
    double intercept() const { return intercept_; }              ///< N0 [1/m^4]; 1/(m^3 mm) is a thousandth of it
    double largestDiameter() const { return largestDiameter_; }  ///< [m]

    /// N(D) [1/m^4]: drops per cubic metre of air and metre of diameter. 0 outside the supported diameters.
    double density(double diameter) const;

    /// Drops per cubic metre with d0 <= D <= d1. Closed form.
    double numberPerVolume(double d0 = 0.0, double d1 = infinity) const { return moment(0, d0, d1); }

    /// Integral of D^k N(D) over [d0, d1] [m^(k-3)], k = 0 to 12. Closed form, to 1e-13 relative for any interval.
    double moment(int k, double d0 = 0.0, double d1 = infinity) const;

    /// The diameter [m] under which a share `u` of the drops in [d0, d1] lies: the inverse of the distribution function
    /// of the truncated exponential. u in [0, 1] gives [d0, d1]. d0 for an empty interval.
    double sampleDiameter(double u, double d0 = 0.0, double d1 = infinity) const;

    /// Half of the water is in drops under this diameter [m]; 3.672 / Lambda where no diameter is cut off. 0: no rain.
    double medianVolumeDiameter() const;

    /// Mass of water per volume of air [kg/m^3].
    double liquidWater(double d0 = 0.0, double d1 = infinity) const;

    /// Extinction coefficient sigma_t [1/m] of the drops in [d0, d1]: Q pi/4 times the second moment.
    /// efficiency  Q = 2 counts the light that is diffracted as lost (Babinet), as meteorological visibility does;
    ///             Q = 1 is the drops' shadow alone. For all diameters Q = 2 gives pi N0 / Lambda^3.
    double extinction(double efficiency = 2.0, double d0 = 0.0, double d1 = infinity) const;

    /// Integral of f(D) N(D) over [d0, d1] by Gauss-Legendre quadrature, split where terminalSpeed() is pieced
    /// together.
    double integrate(const std::function<double(double diameter)>& f, double d0 = 0.0, double d1 = infinity) const;

    /// Drops of [d0, d1] that fall on a level square metre in a second [1/(m^2 s)]: what splashes are counted by.
    double impactsPerAreaAndTime(double d0 = 0.0, double d1 = infinity) const;

    /// Rain [mm/h] that the drops of [d0, d1] bring; over all diameters, rate_mm_h() if sizeMultiplier() is 1.
    double impliedRate_mm_h(double d0 = 0.0, double d1 = infinity) const;

private:
    static constexpr double infinity = std::numeric_limits<double>::infinity();

    double rate_, sizeMultiplier_, largestDiameter_, slope_, intercept_;
};

}  // namespace virga::rainfall
