#include "matte/RainDirection.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/Parallel.h"
#include "core/Simd.h"

namespace virga::matte {
namespace {

// Farid & Simoncelli, "Differentiation of discrete multidimensional signals", 2004, the 5-tap pair, each convolved
// twice with [1 2 1] / 4: the finest detail, where no short filter is a derivative, is left out, and with it the stairs
// that strokes narrower than a pixel are drawn in, which look upright.
constexpr int reach = 4;
constexpr std::array<float, 5> smooth = {0.2891745f, 0.2250129f, 0.1030588f, 0.0249868f,
                                         0.0023537f};                                            // middle and outwards
constexpr std::array<float, 5> change = {0.0f, 0.1138670f, 0.1102743f, 0.0446942f, 0.0068503f};  // the right half; odd

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

/// The filters down the picture; rows: 2 reach + 1 of them.
VIRGA_SIMD void filterDown(const float* const* rows, int width, float* __restrict smoothed, float* __restrict changed)
{
    for (int x = 0; x < width; ++x) {
        float s = smooth[0] * rows[reach][x], c = 0.0f;
        for (int t = 1; t <= reach; ++t) {
            const float above = rows[reach - t][x], below = rows[reach + t][x];
            s += smooth[std::size_t(t)] * (above + below);
            c += change[std::size_t(t)] * (below - above);
        }
        smoothed[x] = s;
        changed[x] = c;
    }
}

/// The filters across, from `reach` before the first pixel: the gradient, and the place of its direction in 0..bins,
/// which means nothing where the gradient is 0.
VIRGA_SIMD void filterAcross(const float* __restrict smoothed, const float* __restrict changed, int width,
                             float* __restrict gx, float* __restrict gy, float* __restrict place)
{
    constexpr float halfPi = float(0.5 * std::numbers::pi), scale = float(bins / std::numbers::pi);
    for (int x = 0; x < width; ++x) {
        float across = 0.0f, down = smooth[0] * changed[x + reach];
        for (int t = 1; t <= reach; ++t) {
            across += change[std::size_t(t)] * (smoothed[x + reach + t] - smoothed[x + reach - t]);
            down += smooth[std::size_t(t)] * (changed[x + reach - t] + changed[x + reach + t]);
        }
        gx[x] = across;
        gy[x] = down;
        // atan(down / across) to 1e-5 rad: Abramowitz & Stegun 1964, 4.4.47.
        const bool isFlat = std::abs(down) <= std::abs(across);
        const float ratio = (isFlat ? down : across) / (isFlat ? across : down), square = ratio * ratio;
        const float angle =
            ratio * (0.9998660f +
                     square * (-0.3302995f + square * (0.1801410f + square * (-0.0851330f + square * 0.0208351f))));
        const float steep = (ratio < 0.0f ? -halfPi : halfPi) - angle;
        place[x] = ((isFlat ? angle : steep) + halfPi) * scale;
    }
}

/// Structure tensors of all gradients of a picture over their lengths, sorted by direction.
Directions gradients(const ImageF& alpha)
{
    Directions sorted{};
    const int inside = alpha.width() - 2 * reach;
    if (inside <= 0) return sorted;
    const auto columns = std::size_t(alpha.width());
    std::vector<float> smoothed(columns), changed(columns), gx(columns), gy(columns), place(columns);
    for (int y = reach; y + reach < alpha.height(); ++y) {
        std::array<const float*, 2 * reach + 1> rows;
        for (int t = 0; t <= 2 * reach; ++t) rows[std::size_t(t)] = alpha.row(y - reach + t);
        filterDown(rows.data(), alpha.width(), smoothed.data(), changed.data());
        filterAcross(smoothed.data(), changed.data(), inside, gx.data(), gy.data(), place.data());
        for (std::size_t x = 0; x < std::size_t(inside); ++x) {
            const double across = gx[x], down = gy[x];
            if (across == 0.0 && down == 0.0) continue;
            // Half a circle on is where it began; what is not finite makes the sum so, in whichever bin.
            const std::size_t bin = place[x] >= 0.0f && place[x] < float(bins) ? std::size_t(place[x]) : 0;
            // By its length, not by its square: see the header.
            sorted[bin].add({across * across, across * down, down * down}, 1.0 / std::hypot(across, down));
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
