// Gauss-Legendre quadrature.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace virga::optics {

/// Nodes in (-1, 1), ascending, and weights that sum to 2: exact for polynomials of degree < 2 * count.
/// Newton's method on P_count from Tricomi's estimates of its roots; 1e-15 for count <= 200.
struct GaussLegendre {
    std::vector<double> node, weight;

    explicit GaussLegendre(int count) : node(std::size_t(count)), weight(std::size_t(count))
    {
        for (int i = 0; i < count; ++i) {
            double x = -std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
            double derivative = 1.0;
            for (int iteration = 0; iteration < 8; ++iteration) {
                double previous = 1.0, value = x;
                for (int l = 2; l <= count; ++l) {
                    const double next = ((2 * l - 1) * x * value - (l - 1) * previous) / l;
                    previous = value;
                    value = next;
                }
                derivative = count * (x * value - previous) / (x * x - 1.0);
                const double step = value / derivative;
                x -= step;
                if (std::abs(step) < 1e-16) break;
            }
            node[std::size_t(i)] = x;
            weight[std::size_t(i)] = 2.0 / ((1.0 - x * x) * derivative * derivative);
        }
    }
};

}  // namespace virga::optics
