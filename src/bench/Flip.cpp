#include "bench/Flip.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <glm/vec3.hpp>
#include <numbers>
#include <vector>

#include "core/Parallel.h"

namespace virga::bench {
namespace {

using Plane = std::vector<double>;
using Color = glm::dvec3;
constexpr double pi = std::numbers::pi;

// sRGB's primaries and its white.
Color xyzOf(const Color& c)
{
    return {0.4124564 * c.x + 0.3575761 * c.y + 0.1804375 * c.z, 0.2126729 * c.x + 0.7151522 * c.y + 0.0721750 * c.z,
            0.0193339 * c.x + 0.1191920 * c.y + 0.9503041 * c.z};
}
Color rgbOf(const Color& c)
{
    return {3.2404542 * c.x - 1.5371385 * c.y - 0.4985314 * c.z, -0.9692660 * c.x + 1.8760108 * c.y + 0.0415560 * c.z,
            0.0556434 * c.x - 0.2040259 * c.y + 1.0572252 * c.z};
}
const Color white = xyzOf(Color(1.0));

/// The linear twin of L*a*b* (section 4.1.1).
Color yCxCzOf(const Color& rgb)
{
    const Color r = xyzOf(rgb) / white;
    return {116 * r.y - 16, 500 * (r.x - r.y), 200 * (r.y - r.z)};
}
Color rgbOfYCxCz(const Color& c)
{
    const double y = (c.x + 16) / 116;
    return rgbOf(Color(y + c.y / 500, y, y - c.z / 200) * white);
}

/// L*a*b*, with colours that are the stronger the brighter they are (Hunt 1952; section 4.1.2).
Color huntLabOf(const Color& rgb)
{
    const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
    const Color r = xyzOf(rgb) / white;
    const double lightness = 116 * f(r.y) - 16;
    return {lightness, 0.01 * lightness * 500 * (f(r.x) - f(r.y)), 0.01 * lightness * 200 * (f(r.y) - f(r.z))};
}

/// HyAB (Abasi et al. 2020): city blocks between lightness and colour, straight within colour.
double hyab(const Color& a, const Color& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

/// A plane filtered along rows, then along columns; its border goes on beyond the picture.
Plane separable(const Plane& plane, int width, int height, const Plane& across, const Plane& down)
{
    const int reach = int(across.size() / 2);
    Plane half(plane.size()), result(plane.size());
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = -reach; k <= reach; ++k)
                half[std::size_t(y * width + x)] +=
                    across[std::size_t(k + reach)] * plane[std::size_t(y * width + std::clamp(x + k, 0, width - 1))];
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            for (int k = -reach; k <= reach; ++k)
                result[std::size_t(y * width + x)] +=
                    down[std::size_t(k + reach)] * half[std::size_t(std::clamp(y + k, 0, height - 1) * width + x)];
    return result;
}

Plane sampled(int reach, const std::function<double(double)>& f)
{
    Plane kernel;
    for (int k = -reach; k <= reach; ++k) kernel.push_back(f(k));
    return kernel;
}

/// One term a sqrt(pi / b) exp(-pi^2 x^2 / b) of a contrast sensitivity, x in degrees, as a two-dimensional filter:
/// what it weighs, and the filter of weight 1 along one axis.
struct Term {
    double weight;
    Plane kernel;
};
std::vector<Term> sensitivity(std::initializer_list<std::pair<double, double>> terms, double pixelsPerDegree)
{
    constexpr double widest = 0.04;  // the largest b
    const int reach = int(std::ceil(3 * std::sqrt(widest / (2 * pi * pi)) * pixelsPerDegree));
    std::vector<Term> result;
    double whole = 0;
    for (const auto& [a, b] : terms) {
        Plane kernel =
            sampled(reach, [&](double k) { return std::exp(-pi * pi * std::pow(k / pixelsPerDegree, 2) / b); });
        double sum = 0;
        for (const double value : kernel) sum += value;
        for (double& value : kernel) value /= sum;
        result.push_back({a * std::sqrt(pi / b) * sum * sum, std::move(kernel)});
        whole += result.back().weight;
    }
    for (Term& term : result) term.weight /= whole;
    return result;
}

struct Picture {
    std::vector<Color> filtered;  // L*a*b* with Hunt's effect
    Plane edge, point;            // how strong
};

Picture seen(ConstImageViewF image, double pixelsPerDegree)
{
    const int width = image.width(), height = image.height();
    const auto count = std::size_t(width) * std::size_t(height);
    Plane planes[3] = {Plane(count), Plane(count), Plane(count)}, luminance(count);
    for (std::size_t i = 0; i < count; ++i) {
        const float* p = image.pixel(int(i) % width, int(i) / width);
        Color rgb;
        for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(double(p[c]), 0.0, 1.0);
        const Color opponent = yCxCzOf(rgb);
        for (int c = 0; c < 3; ++c) planes[c][i] = opponent[c];
        luminance[i] = (opponent.x + 16) / 116;
    }

    const std::vector<Term> channels[3] = {sensitivity({{1, 0.0047}}, pixelsPerDegree),
                                           sensitivity({{1, 0.0053}}, pixelsPerDegree),
                                           sensitivity({{34.1, 0.04}, {13.5, 0.025}}, pixelsPerDegree)};
    Picture picture;
    picture.filtered.resize(count);
    std::vector<Color> opponent(count, Color(0.0));
    for (int c = 0; c < 3; ++c)
        for (const Term& term : channels[c]) {
            const Plane part = separable(planes[c], width, height, term.kernel, term.kernel);
            for (std::size_t i = 0; i < count; ++i) opponent[i][c] += term.weight * part[i];
        }
    for (std::size_t i = 0; i < count; ++i) {
        Color rgb = rgbOfYCxCz(opponent[i]);
        for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(rgb[c], 0.0, 1.0);
        picture.filtered[i] = huntLabOf(rgb);
    }

    // First and second derivatives of a Gaussian whose bright part is 0.082 degrees wide; positive weights add up to 1,
    // negative ones to -1 (section 4.2).
    const double sigma = 0.5 * 0.082 * pixelsPerDegree;
    const int reach = int(std::ceil(3 * sigma));
    const auto bell = [&](double x) { return std::exp(-0.5 * x * x / (sigma * sigma)); };
    Plane smooth = sampled(reach, bell), slope = sampled(reach, [&](double x) { return -x * bell(x); }),
          bend = sampled(reach, [&](double x) { return (x * x / (sigma * sigma) - 1) * bell(x); });
    for (Plane* kernel : {&smooth, &slope, &bend}) {
        double above = 0, below = 0;
        for (const double value : *kernel) (value > 0 ? above : below) += std::abs(value);
        for (double& value : *kernel) value /= value > 0 ? above : below;
    }
    const auto strength = [&](const Plane& derivative) {
        Plane x = separable(luminance, width, height, derivative, smooth);
        const Plane y = separable(luminance, width, height, smooth, derivative);
        for (std::size_t i = 0; i < count; ++i) x[i] = std::hypot(x[i], y[i]);
        return x;
    };
    picture.edge = strength(slope);
    picture.point = strength(bend);
    return picture;
}

}  // namespace

ImageF flip(ConstImageViewF a, ConstImageViewF b, double pixelsPerDegree)
{
    assert(a.width() == b.width() && a.height() == b.height());
    constexpr double colorPower = 0.7, featurePower = 0.5, knee = 0.4, atKnee = 0.95;  // q_c, q_f, p_c, p_t
    // Nothing on a display is farther apart than its green and its blue.
    static const double most = std::pow(hyab(huntLabOf({0, 1, 0}), huntLabOf({0, 0, 1})), colorPower);
    Picture pictures[2];
    parallelFor(0, 2, 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t i = first; i < last; ++i) pictures[i] = seen(i == 0 ? a : b, pixelsPerDegree);
    });
    const auto& [p, q] = pictures;
    ImageF result(a.width(), a.height(), 1);
    for (std::size_t i = 0; i < result.size(); ++i) {
        const double apart = std::pow(hyab(p.filtered[i], q.filtered[i]), colorPower) / most;
        const double color = apart < knee ? apart / knee * atKnee : atKnee + (apart - knee) / (1 - knee) * (1 - atKnee);
        const double feature = std::max(std::abs(p.edge[i] - q.edge[i]), std::abs(p.point[i] - q.point[i]));
        const double features = std::pow(feature / std::numbers::sqrt2, featurePower);
        result.data()[i] = float(std::pow(std::clamp(color, 0.0, 1.0), 1 - std::min(features, 1.0)));
    }
    return result;
}

double meanFlip(ConstImageViewF a, ConstImageViewF b, double pixelsPerDegree)
{
    double sum = 0;
    const ImageF map = flip(a, b, pixelsPerDegree);
    for (const float value : map.values()) sum += double(value);
    return sum / double(map.size());
}

}  // namespace virga::bench
