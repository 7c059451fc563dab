#include "reference/UndrawnRain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reference/DropPaths.h"

namespace virga::reference {

double undrawnOpticalDepth(double depth_m, const rainfall::DropSizes& sizes, const particles::RainField& field,
                           const particles::Visibility& visibility, bool allDrops, double focal_px, double exposure_s)
{
    if (field.classes().empty()) return 0;
    const double depth = std::min(depth_m, visibility.far_m);
    double perDensity = depth * sizes.extinction(1.0, 0.0, field.classes().front().d0);
    if (!allDrops)
        for (const rainfall::SizeClass& c : field.classes()) {
            // The mean over the class by Simpson's rule; drawnDepth() has a kink where it meets near and depth.
            constexpr int steps = 400;
            double sum = 0;
            for (int i = 0; i <= steps; ++i) {
                const double d = c.d0 + (c.d1 - c.d0) * i / steps;
                const double drawn =
                    drawnDepth(d, field.motion().fallSpeed(c.speed) * exposure_s, focal_px, visibility.threshold);
                const double hidden = std::max(0.0, depth - (drawn > visibility.near_m ? drawn : 0.0));
                const double weight = i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2;
                sum += weight * sizes.density(d) * std::numbers::pi / 4 * d * d * hidden;
            }
            perDensity += sum * (c.d1 - c.d0) / (3 * steps);
        }
    return perDensity * field.densityScale();
}

std::vector<double> thinnedOpticalDepths(const std::vector<double>& depths_m, const rainfall::DropSizes& sizes,
                                         const particles::RainField& field, const particles::Visibility& visibility,
                                         double focal_px, double exposure_s)
{
    // Extinction per metre at a depth, by Simpson's rule over each class's diameters, added up along the depth by the
    // midpoint rule.
    const auto extinctionAt = [&](double depth) {
        double sum = 0;
        if (depth < visibility.near_m || depth > visibility.far_m) return sum;
        for (const rainfall::SizeClass& c : field.classes()) {
            constexpr int steps = 100;
            const double way = field.motion().fallSpeed(c.speed) * exposure_s;
            for (int i = 0; i <= steps; ++i) {
                const double d = c.d0 + (c.d1 - c.d0) * i / steps;
                if (depth > drawnDepth(d, way, focal_px, visibility.threshold)) continue;
                const double weight = (i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2) * (c.d1 - c.d0) / (3 * steps);
                sum += weight * sizes.density(d) * std::numbers::pi / 4 * d * d *
                       (1 - thinnedShare(d, way, focal_px, depth, visibility.thin));
            }
        }
        return sum * field.densityScale();
    };
    std::vector<double> result;
    double reached = 0, sum = 0;
    for (const double depth : depths_m) {
        constexpr int steps = 8;
        const double to = std::min(depth, visibility.far_m), step = (to - reached) / steps;
        for (int i = 0; i < steps; ++i) sum += step * extinctionAt(reached + (i + 0.5) * step);
        reached = to;
        result.push_back(sum);
    }
    return result;
}

}  // namespace virga::reference
