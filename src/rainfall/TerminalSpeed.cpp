#include "rainfall/TerminalSpeed.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace virga::rainfall {
namespace {

struct Point {
    double diameter_mm, speed;  // [mm], [m/s]
};

// Gunn & Kinzer 1949, Table 2.
constexpr std::array<Point, 34> gunnKinzer{{
    {0.1, 0.27}, {0.2, 0.72}, {0.3, 1.17}, {0.4, 1.62}, {0.5, 2.06}, {0.6, 2.47}, {0.7, 2.87}, {0.8, 3.27}, {0.9, 3.67},
    {1.0, 4.03}, {1.2, 4.64}, {1.4, 5.17}, {1.6, 5.65}, {1.8, 6.09}, {2.0, 6.49}, {2.2, 6.90}, {2.4, 7.27}, {2.6, 7.57},
    {2.8, 7.82}, {3.0, 8.06}, {3.2, 8.26}, {3.4, 8.44}, {3.6, 8.60}, {3.8, 8.72}, {4.0, 8.83}, {4.2, 8.92}, {4.4, 8.98},
    {4.6, 9.03}, {4.8, 9.07}, {5.0, 9.09}, {5.2, 9.12}, {5.4, 9.14}, {5.6, 9.16}, {5.8, 9.17},
}};

constexpr double greatestSpeed = 9.23;  // [m/s], where the tables that go beyond 5.8 mm level out

/// v = g (rho_water - rho_air) D^2 / (18 mu), in m/s for D in mm: 9.81 * 997 / (18 * 1.82e-5) * 1e-6.
constexpr double stokes = 29.86;

struct Curve {
    std::array<double, gunnKinzer.size()> slope{};  // dv/dD [m/s per mm] at the table's points

    // Below the first point v = stokes D^2 / (1 + drag (D / D_first)^power).
    double drag = 0, power = 0;
    // Above the last point greatestSpeed - v decays over this many mm.
    double relaxation = 0;

    Curve()
    {
        constexpr std::size_t n = gunnKinzer.size();
        std::array<double, n - 1> secant{};
        std::array<double, n - 1> step{};
        for (std::size_t i = 0; i + 1 < n; ++i) {
            step[i] = gunnKinzer[i + 1].diameter_mm - gunnKinzer[i].diameter_mm;
            secant[i] = (gunnKinzer[i + 1].speed - gunnKinzer[i].speed) / step[i];
        }
        // Brodlie's weighted harmonic mean keeps every piece monotone. At the ends the neighbouring secant serves.
        slope.front() = secant.front();
        slope.back() = secant.back();
        for (std::size_t i = 1; i + 1 < n; ++i) {
            const double weight = (step[i - 1] + 2.0 * step[i]) / (3.0 * (step[i - 1] + step[i]));
            slope[i] = secant[i - 1] * secant[i] / (weight * secant[i] + (1.0 - weight) * secant[i - 1]);
        }

        const auto [diameter, speed] = gunnKinzer.front();
        drag = stokes * diameter * diameter / speed - 1.0;
        const double logarithmicSlope = slope.front() * diameter / speed;
        power = (2.0 - logarithmicSlope) * (1.0 + drag) / drag;
        relaxation = (greatestSpeed - gunnKinzer.back().speed) / slope.back();
    }

    double operator()(double diameter_mm) const
    {
        if (!(diameter_mm > 0.0)) return 0.0;
        const Point& first = gunnKinzer.front();
        const Point& last = gunnKinzer.back();
        if (diameter_mm < first.diameter_mm) {
            return stokes * diameter_mm * diameter_mm / (1.0 + drag * std::pow(diameter_mm / first.diameter_mm, power));
        }
        if (diameter_mm >= last.diameter_mm) {
            return greatestSpeed -
                   (greatestSpeed - last.speed) * std::exp((last.diameter_mm - diameter_mm) / relaxation);
        }
        const auto above = std::upper_bound(gunnKinzer.begin(), gunnKinzer.end(), diameter_mm,
                                            [](double value, const Point& point) { return value < point.diameter_mm; });
        const std::size_t i = std::size_t(above - gunnKinzer.begin()) - 1;
        const double step = gunnKinzer[i + 1].diameter_mm - gunnKinzer[i].diameter_mm;
        const double t = (diameter_mm - gunnKinzer[i].diameter_mm) / step;
        const double s = 1.0 - t;
        // Cubic Hermite.
        return s * s * (1.0 + 2.0 * t) * gunnKinzer[i].speed + t * t * (1.0 + 2.0 * s) * gunnKinzer[i + 1].speed +
               step * s * t * (s * slope[i] - t * slope[i + 1]);
    }
};

}  // namespace

double terminalSpeed(double diameter) noexcept
{
    static const Curve curve;
    return curve(1e3 * diameter);
}

}  // namespace virga::rainfall
