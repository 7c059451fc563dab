#include "rainfall/SizeClasses.h"

#include <algorithm>
#include <cmath>

#include "core/Error.h"
#include "rainfall/TerminalSpeed.h"

namespace virga::rainfall {
namespace {

constexpr double speedShare = 1.0 / 3.0;

/// Running integral over diameter of a density known at equal steps, by the trapezoid rule.
struct Cumulative {
    std::vector<double> diameter, visible, measure;  // both from 0 to 1

    Cumulative(const DropSizes& sizes, const SizeClassOptions& options)
    {
        constexpr int steps = 4096;
        const double d0 = options.smallestDiameter;
        const double d1 = sizes.largestDiameter();
        const auto density = [&](double d) {
            const double reach = std::min(d * d / terminalSpeed(d) * options.sight, options.farthest);
            return sizes.density(d) * reach * reach * reach;
        };
        diameter.resize(steps + 1);
        visible.resize(steps + 1);
        measure.resize(steps + 1);
        double previous = density(d0);
        diameter[0] = d0;
        for (int i = 1; i <= steps; ++i) {
            const std::size_t at = std::size_t(i);
            diameter[at] = d0 + (d1 - d0) * i / steps;
            const double here = density(diameter[at]);
            visible[at] = visible[at - 1] + 0.5 * (previous + here);
            previous = here;
        }
        const double slowest = terminalSpeed(d0);
        const double fastest = terminalSpeed(d1);
        const double total = visible.back();
        for (std::size_t i = 0; i < visible.size(); ++i) {
            visible[i] /= total;
            measure[i] = (1.0 - speedShare) * visible[i] +
                         speedShare * (terminalSpeed(diameter[i]) - slowest) / (fastest - slowest);
        }
    }

    /// Reads column `to` where column `from` has `value`.
    static double look(const std::vector<double>& from, const std::vector<double>& to, double value)
    {
        const auto above = std::upper_bound(from.begin() + 1, from.end() - 1, value);
        const std::size_t i = std::size_t(above - from.begin());
        const double width = from[i] - from[i - 1];
        const double t = width > 0.0 ? std::clamp((value - from[i - 1]) / width, 0.0, 1.0) : 0.0;
        return to[i - 1] + t * (to[i] - to[i - 1]);
    }
};

}  // namespace

std::vector<SizeClass> makeSizeClasses(const DropSizes& sizes, const SizeClassOptions& options)
{
    if (options.count < 1 || options.count > 256) {
        throw Error(ErrorCode::InvalidArgument, "{} size classes: must be from 1 to 256", options.count);
    }
    if (!(options.smallestDiameter > 0.0 && options.smallestDiameter < sizes.largestDiameter())) {
        throw Error(ErrorCode::InvalidArgument, "smallest drop {} mm: must be between 0 and the largest drop, {} mm",
                    1e3 * options.smallestDiameter, 1e3 * sizes.largestDiameter());
    }
    if (!(options.sight > 0.0 && options.farthest > 0.0)) {
        throw Error(ErrorCode::InvalidArgument, "sight {} and farthest {} m of the size classes: must be positive",
                    options.sight, options.farthest);
    }
    std::vector<SizeClass> classes;
    if (sizes.empty()) return classes;

    const Cumulative cumulative(sizes, options);
    const auto edge = [&](int i) {
        if (i == 0) return options.smallestDiameter;
        if (i == options.count) return sizes.largestDiameter();
        return Cumulative::look(cumulative.measure, cumulative.diameter, double(i) / options.count);
    };
    for (int i = 0; i < options.count; ++i) {
        SizeClass c{};
        c.d0 = edge(i);
        c.d1 = edge(i + 1);
        c.numberPerVolume = sizes.numberPerVolume(c.d0, c.d1);
        // Very light rain runs out of doubles before it runs out of diameters: no class without drops.
        if (!(c.numberPerVolume > 0.0)) continue;
        c.meanDiameter = sizes.moment(1, c.d0, c.d1) / c.numberPerVolume;
        c.meanSquare = sizes.moment(2, c.d0, c.d1) / c.numberPerVolume;
        c.meanCube = sizes.moment(3, c.d0, c.d1) / c.numberPerVolume;
        c.speed = sizes.integrate([](double d) { return d * d * d * terminalSpeed(d); }, c.d0, c.d1) /
                  sizes.moment(3, c.d0, c.d1);
        c.speedError = std::max(terminalSpeed(c.d1) - c.speed, c.speed - terminalSpeed(c.d0));
        c.weight = Cumulative::look(cumulative.diameter, cumulative.visible, c.d1) -
                   Cumulative::look(cumulative.diameter, cumulative.visible, c.d0);
        classes.push_back(c);
    }
    return classes;
}

}  // namespace virga::rainfall
