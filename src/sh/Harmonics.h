// Real spherical harmonics of RGB functions on the sphere.
//
// Basis: orthonormal (the integral of Y_lm^2 over the sphere is 1), no Condon-Shortley sign,
//   Y_l0 = P_l0(cos t),  Y_lm = sqrt(2) P_lm(cos t) cos(m p),  Y_l-m = sqrt(2) P_lm(cos t) sin(m p),  m > 0,
// with P_lm the normalised associated Legendre functions, t the angle from the world's +y and p the azimuth from -z
// towards -x, which is right-handed about +y: (x', y', z') = (-z, -x, y) are the textbook's axes. Coefficient (l, m) is
// number l (l + 1) + m. The recurrences in l at fixed m are stable (Holmes & Featherstone 2002); to order 1024 what
// underflows near the poles is below 1e-200 anyway.
//
// All sums are in double precision and in an order that does not depend on the number of threads.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/Image.h"

namespace virga::sh {

constexpr int maxOrder = 1024;

constexpr std::size_t coefficientCount(int order) { return std::size_t(order + 1) * std::size_t(order + 1); }
constexpr std::size_t coefficientIndex(int l, int m) { return std::size_t(std::ptrdiff_t(l) * (l + 1) + m); }

/// sum of coefficient[lm] Y_lm over l <= order; one vec3 (R, G, B) for each (l, m).
struct Harmonics {
    int order = 0;
    std::vector<glm::dvec3> coefficient = std::vector<glm::dvec3>(1);

    Harmonics() = default;
    explicit Harmonics(int order_) : order(order_), coefficient(coefficientCount(order_)) {}
};

/// All Y_lm of one direction (unit vector), l <= order, by number.
std::vector<double> basis(int order, const glm::dvec3& direction);

/// Weights of the rows' centres that integrate polynomials in cos(t) of degree < height exactly (Fejer 1933, first
/// rule). Positive; they sum to 2. A map that is band-limited to l <= order is thus projected exactly, to rounding, if
/// 2 * order < height and 2 * order < width; a constant map has a constant's coefficients and no others.
std::vector<double> rowWeights(int height);

/// What the value of a pixel says of the map.
enum class PixelValue {
    Sample,  ///< its value at the pixel's centre: maps that were baked from formulas or harmonics
    Mean,    ///< its mean over the pixel, taken to hold all over it: maps that cameras and renderers deliver
};

/// Coefficients of an equirectangular map with 3 or more channels (the first 3 count). Separable: Fourier sums along
/// the rows (RowTransform.h), then Legendre sums down the columns.
///
/// Sample: with rowWeights(); exact to rounding for band-limited maps. Throws Error(InvalidArgument) unless
/// 2 * order < min(width, height).
///
/// Mean: every pixel's value times the exact integral of Y_lm over the pixel, at any order. What a pixel adds is its
/// value times its solid angle, to the last row; rowWeights() are 13 % below that in the rows at the poles, 2.4 % above
/// in the next, which matters for a light near the zenith. A map is taken for the patches that it is, so that band l of
/// a smooth one comes out smaller by up to l (l + 1) / 24 times the square of a pixel's height in radians (0.17 % at
/// band 16 of 512 x 256), and by as much again if its pixels are indeed means.
///
/// Throws Error(InvalidArgument) if the order is not from 0 to maxOrder. Widths that are no multiple of 4, and orders
/// over 96, go through FFTs: large prime factors are slow there.
Harmonics projectPanorama(ConstImageViewF map, int order, PixelValue pixels = PixelValue::Sample);

/// Convolution with a function of the angle alone (Funk 1916, Hecke 1918): band l of channel c is multiplied by
/// factor[c][l]. Bands that `factor` does not reach become 0.
void convolve(Harmonics& harmonics, const std::vector<double> (&factor)[3]);

/// The same function with the bands above `order` left out.
Harmonics truncated(const Harmonics& harmonics, int order);

/// Its value along a unit vector.
glm::dvec3 evaluate(const Harmonics& harmonics, const glm::dvec3& direction);

/// Its values at the pixel centres of an equirectangular map, 3 channels. Separable. width > 2 * order.
ImageF bakePanorama(const Harmonics& harmonics, int width, int height);

/// For each band l the sum over m of the squared coefficients: its mean square over the sphere times 4 pi.
std::vector<glm::dvec3> bandEnergies(const Harmonics& harmonics);

}  // namespace virga::sh
