#include "optics/Airlight.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "optics/GaussLegendre.h"

namespace virga::optics {

double airlight(double along, double across, double distance, double extinction)
{
    if (!(extinction > 0.0) || !(distance > 0.0)) return 0.0;
    const double straight = std::hypot(along, across);  // camera to lamp
    if (across == 0.0 && along >= 0.0) {
        // Between lamp and camera all light goes straight: Y = 0, but the fraction is infinite.
        if (distance >= along) return std::numeric_limits<double>::infinity();
        return extinction * std::exp(-extinction * along) * distance /
               (4.0 * std::numbers::pi * along * (along - distance));
    }

    // The detours' ends: l - s, and Y, in forms that do not cancel (a - b = (a^2 - b^2) / (a + b)).
    const double start = along > 0.0 ? across * (across / (straight + along)) : straight - along;
    double detour = 45.0 / extinction;
    if (std::isfinite(distance)) {
        const double rest = distance - along, atSurface = std::hypot(rest, across);
        const double end = rest > 0.0 ? atSurface + rest : across * (across / (atSurface - rest));
        detour = std::min(detour, distance * ((start + end) / (straight + atSurface)));
    }

    // y = scale (exp(u) - 1). The fraction's poles, at y = -start +- i across, stay at least pi/4 off the real u, and
    // a panel of length 1 takes exp(-beta y) through less than it can vary before it is over.
    const double scale = std::min(std::hypot(across, start), 1.0 / extinction);
    const double last = std::log1p(detour / scale);
    const int panels = std::max(1, int(std::ceil(last)));
    static const GaussLegendre rule(20);
    double sum = 0.0;
    for (int panel = 0; panel < panels; ++panel) {
        const double half = 0.5 * last / panels, middle = (2 * panel + 1) * half;
        for (std::size_t i = 0; i < rule.node.size(); ++i) {
            const double u = middle + half * rule.node[i];
            const double y = scale * std::expm1(u), from = start + y;
            sum += half * rule.weight[i] * scale * std::exp(u - extinction * y) / (across * across + from * from);
        }
    }
    return extinction / (2.0 * std::numbers::pi) * std::exp(-extinction * straight) * sum;
}

}  // namespace virga::optics
