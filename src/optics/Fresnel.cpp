#include "optics/Fresnel.h"

#include <cmath>

namespace virga::optics {

Fresnel fresnel(double cosIncidence, double relativeIndex) noexcept
{
    const double n = relativeIndex;
    // n cos(refraction), from Snell's law as n^2 - sin^2; (n-1)(n+1) + cos^2 keeps the digits of n near 1.
    const double square = (n - 1.0) * (n + 1.0) + cosIncidence * cosIncidence;
    if (square <= 0.0) return {1.0, 1.0};
    const double nCosRefraction = std::sqrt(square);
    const double s = (cosIncidence - nCosRefraction) / (cosIncidence + nCosRefraction);
    const double p = (n * n * cosIncidence - nCosRefraction) / (n * n * cosIncidence + nCosRefraction);
    return {s * s, p * p};
}

double brewsterAngle(double relativeIndex) noexcept { return std::atan(relativeIndex); }

double criticalAngle(double relativeIndex) noexcept { return std::asin(1.0 / relativeIndex); }

}  // namespace virga::optics
