// The mean shape of a falling drop: flat below, round above.
//
//   r(theta) = a (1 + sum_{n=0}^{10} C_n cos(n theta)),   theta = 0 straight down.
//
// Beard & Chuang 1987, "A new model for the equilibrium shape of raindrops", J. Atmos. Sci. 44: 1509-1524; coefficients
// for a = 0.5, 1, 3 and 4.5 mm as Rousseau et al. 2006 give them ("Realistic real-time rain rendering", Eq. 1, Table
// 1). Between these, and down to the sphere at a = 0, each C_n follows a monotone cubic over a. The printed
// coefficients keep the volume to 0.12 %; here r is scaled so that it is 4/3 pi a^3 for every a.
#pragma once

#include <array>

namespace virga::optics {

class DropShape {
public:
    /// equivolumeRadius  a [m], >= 0; beyond 4.5 mm the shape of 4.5 mm, larger
    explicit DropShape(double equivolumeRadius) noexcept;

    double equivolumeRadius() const { return radius_; }                          ///< a [m]
    const std::array<double, 11>& coefficients() const { return coefficient_; }  ///< C_n, before scaling

    /// Distance of the surface from the origin [m] at polar angle theta [rad] from straight down; origin near the
    /// centre of mass.
    double radius(double theta) const noexcept;

    double width() const { return width_; }    ///< [m], largest horizontal diameter
    double height() const { return height_; }  ///< [m], vertical extent
    double axisRatio() const
    {
        return width_ > 0 ? height_ / width_ : 1;
    }                                          ///< 1 for a sphere; 0.51 for the largest drops
    double volume() const { return volume_; }  ///< [m^3]

private:
    double radius_, scale_ = 1, width_ = 0, height_ = 0, volume_ = 0;
    std::array<double, 11> coefficient_{};
};

/// Mean axis ratio 1.03 - 0.062 D/mm, 1 to 9 mm; held to 1 below. Pruppacher & Beard 1970. A check on the shapes, and
/// enough where only the ratio counts. diameter [m].
double meanAxisRatio(double diameter) noexcept;

}  // namespace virga::optics
