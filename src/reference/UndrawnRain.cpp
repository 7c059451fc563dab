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
                const double drawn = drawnDepth(d, c.speed * exposure_s, focal_px, visibility.threshold);
                const double hidden = std::max(0.0, depth - (drawn > visibility.near_m ? drawn : 0.0));
                const double weight = i == 0 || i == steps ? 1 : i % 2 == 1 ? 4 : 2;
                sum += weight * sizes.density(d) * std::numbers::pi / 4 * d * d * hidden;
            }
            perDensity += sum * (c.d1 - c.d0) / (3 * steps);
        }
    return perDensity * field.densityScale();
}

}  // namespace virga::reference
