#include "matte/RainDirection.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

// Farid & Simoncelli, "Differentiation of discrete multidimensional signals", 2004, the 5-tap pair, each convolved with
// [1 2 1] / 4: the finest detail, where no short filter is a derivative, is left out.
constexpr int reach = 3;
constexpr std::array<double, 4> smooth = {0.337764, 0.240585, 0.08111775, 0.00941475};  // middle and outwards
constexpr std::array<double, 4> change = {0.0, 0.1657465, 0.12397475, 0.027401};        // the right half; odd

constexpr int bins = 720;                                  // of the gradient's direction, half a circle
constexpr double width = 20.0 / 180.0 * std::numbers::pi;  // of the biweight about the rain's direction [rad]
constexpr int refinements = 6;

struct Tensor {
    double xx = 0, xy = 0, yy = 0;

    void add(const Tensor& other, double weight)
    {
        xx += weight * other.xx;
        xy += weight * other.xy;
        yy += weight * other.yy;
    }
    double trace() const { return xx + yy; }
    /// Direction of the gradient's main axis from x [rad], -pi/2..pi/2.
    double axis() const { return 0.5 * std::atan2(2.0 * xy, xx - yy); }
};
using Directions = std::array<Tensor, bins>;

int binOf(double angle)
{
    const int bin = int(std::floor((angle / std::numbers::pi + 0.5) * bins));
    return ((bin % bins) + bins) % bins;
}

/// Structure tensors of all gradients of a picture, sorted by direction.
Directions gradients(const ImageF& alpha)
{
    Directions sorted{};
    const int columns = alpha.width(), rows = alpha.height();
    std::vector<double> smoothed(static_cast<std::size_t>(columns)), changed(static_cast<std::size_t>(columns));
    for (int y = reach; y + reach < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
            double s = smooth[0] * alpha.at(x, y), c = 0.0;
            for (int t = 1; t <= reach; ++t) {
                const double above = alpha.at(x, y - t), below = alpha.at(x, y + t);
                s += smooth[std::size_t(t)] * (above + below);
                c += change[std::size_t(t)] * (below - above);
            }
            smoothed[std::size_t(x)] = s;
            changed[std::size_t(x)] = c;
        }
        for (int x = reach; x + reach < columns; ++x) {
            double gx = 0.0, gy = smooth[0] * changed[std::size_t(x)];
            const auto middle = std::size_t(x);
            for (std::size_t t = 1; t <= reach; ++t) {
                gx += change[t] * (smoothed[middle + t] - smoothed[middle - t]);
                gy += smooth[t] * (changed[middle - t] + changed[middle + t]);
            }
            if (gx == 0.0 && gy == 0.0) continue;
            sorted[std::size_t(binOf(std::atan(gy / gx)))].add({gx * gx, gx * gy, gy * gy}, 1.0);
        }
    }
    return sorted;
}

}  // namespace

RainDirection rainDirection(std::span<const ImageF> alphas)
{
    std::vector<Directions> parts(alphas.size());
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k) parts[std::size_t(k)] = gradients(alphas[std::size_t(k)]);
    });
    Directions sorted{};
    Tensor all;
    for (const Directions& part : parts)
        for (std::size_t b = 0; b < part.size(); ++b) {
            sorted[b].add(part[b], 1.0);
            all.add(part[b], 1.0);
        }
    if (!(all.trace() > 0.0) || !std::isfinite(all.trace())) return {};

    double axis = all.axis();
    for (int refinement = 0; refinement < refinements; ++refinement) {
        Tensor near;
        for (int b = 0; b < bins; ++b) {
            const double away =
                std::remainder((b + 0.5) / bins * std::numbers::pi - 0.5 * std::numbers::pi - axis, std::numbers::pi);
            const double share = away / width;
            if (std::abs(share) < 1.0) near.add(sorted[std::size_t(b)], (1.0 - share * share) * (1.0 - share * share));
        }
        if (!(near.trace() > 0.0)) break;
        axis = near.axis();
    }
    // For lines along (sin a, cos a) the gradient is along (cos a, -sin a).
    return {-axis, std::hypot(all.xx - all.yy, 2.0 * all.xy) / all.trace()};
}

}  // namespace virga::matte
