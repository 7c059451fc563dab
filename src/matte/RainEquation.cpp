#include "matte/RainEquation.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/Parallel.h"
#include "core/Simd.h"

namespace virga::matte {
namespace {

constexpr int mostSteps = 500;

double rainRoughness(const ImageF& alpha, const RainTerms& terms)
{
    const int width = alpha.width(), height = alpha.height();
    double sum = 0.0;
    const double s = std::sin(terms.slant), c = std::cos(terms.slant);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const double here = alpha.at(x, y);
            const double along = (x + 1 < width ? s * (alpha.at(x + 1, y) - here) : 0.0) +
                                 (y + 1 < height ? c * (alpha.at(x, y + 1) - here) : 0.0);
            sum += along * along;
        }
    return sum;
}

}  // namespace

// ---------------------------------------------------------------------------------------------------------------------

RainObjective rainObjective(const Footage& footage, const ImageF& scene, std::span<const ImageF> alphas,
                            const RainTerms& terms)
{
    const std::span<const ImageF> frames = footage.frames;
    assert(frames.size() == alphas.size());
    const int channels = scene.channels();
    std::vector<RainObjective> parts(frames.size());
    parallelFor(0, std::ptrdiff_t(frames.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k) {
            const ImageF &frame = frames[std::size_t(k)], &alpha = alphas[std::size_t(k)];
            RainObjective& part = parts[std::size_t(k)];
            for (std::size_t i = 0; i < alpha.size(); ++i) {
                const double a = alpha.data()[i], trust = footage.trusted(std::size_t(k), i);
                for (int j = 0; j < channels; ++j) {
                    const double e = frame.data()[i * channels + j] - (1.0 - a) * scene.data()[i * channels + j] -
                                     a * terms.color[j];
                    part.data += trust * e * e;
                }
                part.cost += 2.0 * terms.eta * footage.costing(std::size_t(k), i) * a;
            }
            part.rain = terms.mu * rainRoughness(alpha, terms);
        }
    });
    RainObjective sum;
    for (const RainObjective& part : parts) {
        sum.data += part.data;
        sum.rain += part.rain;
        sum.cost += part.cost;
    }
    for (int y = 0; y < scene.height(); ++y)
        for (int x = 0; x < scene.width(); ++x)
            for (int j = 0; j < channels; ++j) {
                const double here = scene.at(x, y, j);
                const double dx = x + 1 < scene.width() ? scene.at(x + 1, y, j) - here : 0.0;
                const double dy = y + 1 < scene.height() ? scene.at(x, y + 1, j) - here : 0.0;
                sum.scene += terms.lambda * (dx * dx + dy * dy);
            }
    return sum;
}

void solveScene(const Footage& footage, std::span<const ImageF> alphas, const RainTerms& terms, ImageF& scene,
                double tolerance)
{
    const std::span<const ImageF> frames = footage.frames;
    assert(frames.size() == alphas.size());
    const int width = scene.width(), height = scene.height(), channels = scene.channels();
    const std::size_t n = std::size_t(width) * std::size_t(height);
    std::vector<double> weight(n), right(n * std::size_t(channels));
    parallelFor(0, std::ptrdiff_t(n), 4096, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::size_t k = 0; k < frames.size(); ++k)
            for (std::ptrdiff_t i = first; i < last; ++i) {
                const double a = alphas[k].data()[i], through = 1.0 - a;
                const double trust = footage.trusted(k, std::size_t(i));
                weight[std::size_t(i)] += trust * through * through;
                for (int j = 0; j < channels; ++j)
                    right[std::size_t(i * channels + j)] +=
                        trust * through * (frames[k].data()[i * channels + j] - a * terms.color[j]);
            }
    });

    // One system a channel, all of the same matrix: diag(weight) + lambda * (5-point Laplacian).
    parallelFor(0, channels, 1, [&](std::ptrdiff_t firstChannel, std::ptrdiff_t lastChannel) {
        for (std::ptrdiff_t j = firstChannel; j < lastChannel; ++j) {
            const auto neighbours = [&](int x, int y) {
                return double(x > 0) + double(x + 1 < width) + double(y > 0) + double(y + 1 < height);
            };
            const auto multiply = [&](const std::vector<double>& v, std::vector<double>& to) {
                std::size_t i = 0;
                for (int y = 0; y < height; ++y)
                    for (int x = 0; x < width; ++x, ++i) {
                        double sum = neighbours(x, y) * v[i];
                        if (x > 0) sum -= v[i - 1];
                        if (x + 1 < width) sum -= v[i + 1];
                        if (y > 0) sum -= v[i - std::size_t(width)];
                        if (y + 1 < height) sum -= v[i + std::size_t(width)];
                        to[i] = weight[i] * v[i] + terms.lambda * sum;
                    }
            };
            std::vector<double> x(n), residual(n), z(n), direction(n), image(n), inverse(n);
            std::size_t i = 0;
            for (int y = 0; y < height; ++y)
                for (int px = 0; px < width; ++px, ++i) {
                    x[i] = scene.data()[i * channels + j];
                    const double diagonal = weight[i] + terms.lambda * neighbours(px, y);
                    inverse[i] = diagonal > 0.0 ? 1.0 / diagonal : 0.0;
                }
            multiply(x, image);
            double scale = 0.0, rz = 0.0;
            for (i = 0; i < n; ++i) {
                const double b = right[i * channels + j];
                residual[i] = b - image[i];
                scale += b * b;
                direction[i] = inverse[i] * residual[i];
                rz += residual[i] * direction[i];
            }
            for (int step = 0; step < mostSteps; ++step) {
                double left = 0.0;
                for (i = 0; i < n; ++i) left += residual[i] * residual[i];
                if (left <= tolerance * tolerance * scale) break;
                multiply(direction, image);
                double curvature = 0.0;
                for (i = 0; i < n; ++i) curvature += direction[i] * image[i];
                if (!(curvature > 0.0)) break;
                const double length = rz / curvature;
                double next = 0.0;
                for (i = 0; i < n; ++i) {
                    x[i] += length * direction[i];
                    residual[i] -= length * image[i];
                    z[i] = inverse[i] * residual[i];
                    next += residual[i] * z[i];
                }
                for (i = 0; i < n; ++i) direction[i] = z[i] + next / rz * direction[i];
                rz = next;
            }
            for (i = 0; i < n; ++i) scene.data()[i * channels + j] = float(x[i]);
        }
    });
}

}  // namespace virga::matte
