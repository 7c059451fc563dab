#include "matte/RainDirection.h"

#include <array>
#include <cmath>
#include <vector>

#include "core/Parallel.h"

namespace virga::matte {
namespace {

// Farid & Simoncelli, "Differentiation of discrete multidimensional signals", 2004, table of 5-tap filters.
constexpr std::array<double, 5> smooth = {0.037659, 0.249153, 0.426375, 0.249153, 0.037659};
constexpr std::array<double, 5> change = {-0.109604, -0.276691, 0.0, 0.276691, 0.109604};

struct Tensor {
    double xx = 0, xy = 0, yy = 0;
};

Tensor structureTensor(const ImageF& alpha)
{
    Tensor sum;
    const int width = alpha.width(), height = alpha.height();
    if (width < 5 || height < 5) return sum;
    std::vector<double> smoothed(static_cast<std::size_t>(width)), changed(static_cast<std::size_t>(width));
    for (int y = 2; y + 2 < height; ++y) {
        for (int x = 0; x < width; ++x) {
            double s = 0.0, c = 0.0;
            for (int t = 0; t < 5; ++t) {
                const double value = alpha.at(x, y + t - 2);
                s += smooth[std::size_t(t)] * value;
                c += change[std::size_t(t)] * value;
            }
            smoothed[std::size_t(x)] = s;
            changed[std::size_t(x)] = c;
        }
        for (int x = 2; x + 2 < width; ++x) {
            double gx = 0.0, gy = 0.0;
            for (int t = 0; t < 5; ++t) {
                gx += change[std::size_t(t)] * smoothed[std::size_t(x + t - 2)];
                gy += smooth[std::size_t(t)] * changed[std::size_t(x + t - 2)];
            }
            sum.xx += gx * gx;
            sum.xy += gx * gy;
            sum.yy += gy * gy;
        }
    }
    return sum;
}

}  // namespace

RainDirection rainDirection(std::span<const ImageF> alphas)
{
    std::vector<Tensor> parts(alphas.size());
    parallelFor(0, std::ptrdiff_t(alphas.size()), 1, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        for (std::ptrdiff_t k = first; k < last; ++k)
            parts[std::size_t(k)] = structureTensor(alphas[std::size_t(k)]);
    });
    Tensor sum;
    for (const Tensor& part : parts) {
        sum.xx += part.xx;
        sum.xy += part.xy;
        sum.yy += part.yy;
    }
    const double trace = sum.xx + sum.yy, spread = std::hypot(sum.xx - sum.yy, 2.0 * sum.xy);
    if (!(trace > 0.0) || !std::isfinite(trace)) return {};
    // The gradient's main axis lies at phi from x; the rain at right angles to it. For lines along (sin a, cos a) the
    // gradient is along (cos a, -sin a): phi = -a.
    return {-0.5 * std::atan2(2.0 * sum.xy, sum.xx - sum.yy), spread / trace};
}

}  // namespace virga::matte
