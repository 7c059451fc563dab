#include "grade/Darken.h"

namespace virga::grade {

std::array<double, 3> darkened(const std::array<double, 3>& c, const Darkening& darkening,
                               const std::array<double, 3>& weights) noexcept
{
    std::array<double, 3> out = c;
    if (darkening.desaturate != 0) {
        const double luminance = weights[0] * c[0] + weights[1] * c[1] + weights[2] * c[2];
        for (int k = 0; k < 3; ++k) out[k] = (1 - darkening.desaturate) * c[k] + darkening.desaturate * luminance;
    }
    if (darkening.darken != 0)
        for (double& value : out) value *= 1 - darkening.darken;
    return out;
}

}  // namespace virga::grade
