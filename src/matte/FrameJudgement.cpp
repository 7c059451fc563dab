#include "matte/FrameJudgement.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "matte/PictureSampling.h"

namespace virga::matte::alignment {
namespace {

constexpr double inlierDistance_px = 1.0;  // of a cell from its place
constexpr double cellPrecision_px = 0.25;  // standard deviation of a cell that counts as textured
constexpr double cellLikeness = 0.7;       // correlation of a cell with itself in the frame

}  // namespace

Judgement judged(const ImageF& from, const ImageF& to, const Grid& grid, int level, const Fit& fit)
{
    Judgement result;
    const int width = from.width(), height = from.height();
    const int cell = std::clamp(std::min(width, height) / 8, 12, 64), stride = cell / 24 + 1;
    const PlaneTransform warp = grid.pixels(level) * fit.frame * grid.pixels(level).inverse();
    const float limit = float(biweight * fit.spread);
    struct CellPoint {
        double x, y;
        float value;
        Gradient gradient;
    };
    std::vector<CellPoint> points;
    double squares = 0;
    for (int top = 2; top + cell <= height - 2; top += cell) {
        for (int left = 2; left + cell <= width - 2; left += cell) {
            points.clear();
            double xx = 0, xy = 0, yy = 0;
            bool inside = true;
            for (int y = top; y < top + cell; y += stride) {
                for (int x = left; x < left + cell; x += stride) {
                    const Point at = warp(x, y);
                    inside = inside && at.x > 2 && at.y > 2 && at.x < to.width() - 3 && at.y < to.height() - 3;
                    const Gradient g = gradientAt(from, x, y);
                    points.push_back({at.x, at.y, from.at(x, y), g});
                    xx += g.x * g.x;
                    xy += g.x * g.y;
                    yy += g.y * g.y;
                }
            }
            if (!inside) continue;
            const double weakest = 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy));
            const double correlated = std::max(1.0, correlatedPixels / (stride * stride));
            if (!(weakest * cellPrecision_px * cellPrecision_px > correlated * fit.sigma * fit.sigma)) continue;
            ++result.textured;

            double dx = 0, dy = 0, likeness = 0, weight = 0;
            bool lost = false;
            for (int step = 0; step < 6 && !lost; ++step) {
                double a = 0, b = 0, c = 0, rx = 0, ry = 0, sw = 0, st = 0, si = 0, stt = 0, sii = 0, sti = 0;
                for (const CellPoint& p : points) {
                    float value;
                    if (!sampleInside(to, p.x + dx, p.y + dy, value)) continue;
                    value = float(fit.gain) * value + float(fit.offset);
                    const float error = value - p.value, t = error / limit;
                    if (!(std::abs(t) < 1)) continue;
                    const double w = double((1 - t * t) * (1 - t * t)), gx = p.gradient.x, gy = p.gradient.y;
                    a += w * gx * gx;
                    b += w * gx * gy;
                    c += w * gy * gy;
                    rx += w * gx * error;
                    ry += w * gy * error;
                    sw += w;
                    st += w * p.value;
                    si += w * value;
                    stt += w * p.value * p.value;
                    sii += w * value * value;
                    sti += w * p.value * value;
                }
                const double determinant = a * c - b * b;
                lost = !(determinant > 1e-6 * a * c) || std::hypot(dx, dy) > 3 * inlierDistance_px;
                if (lost) break;
                const double stepX = (c * rx - b * ry) / determinant, stepY = (a * ry - b * rx) / determinant;
                dx -= stepX;
                dy -= stepY;
                weight = sw / double(points.size());
                likeness =
                    (sw * sti - st * si) / std::sqrt(std::max(1e-30, (sw * stt - st * st) * (sw * sii - si * si)));
                if (std::hypot(stepX, stepY) < 0.01) break;
            }
            if (lost || weight < 0.4 || likeness < cellLikeness || std::hypot(dx, dy) > inlierDistance_px) continue;
            ++result.inliers;
            squares += dx * dx + dy * dy;
        }
    }
    if (result.textured > 0) result.share = double(result.inliers) / result.textured;
    if (result.inliers > 0) result.residual_px = std::ldexp(std::sqrt(squares / result.inliers), level);
    return result;
}

}  // namespace virga::matte::alignment
