#include "reference/DepthBlur.h"

#include <algorithm>
#include <cmath>

#include "core/Parallel.h"

namespace virga::reference {

double blurSigma(double depth_m, double most, double distance_m) { return most * -std::expm1(-depth_m / distance_m); }

ImageD depthBlur(const ImageD& image, ConstImageViewF depth, double most, double distance_m)
{
    constexpr double least = 0.05;  // a Gaussian so narrow has nothing in the next pixel
    constexpr double deviations = 5;
    const int width = image.width(), height = image.height();
    ImageD sigma(width, height, 1, most), result(width, height, 4);
    if (!depth.empty())
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) sigma.at(x, y) = blurSigma(double(depth.at(x, y)), most, distance_m);
    parallelFor(0, height, 1, [&](std::ptrdiff_t firstRow, std::ptrdiff_t lastRow) {
        for (int y = int(firstRow); y < int(lastRow); ++y)
            for (int x = 0; x < width; ++x) {
                const double own = sigma.at(x, y);
                const int reach = own < least ? 0 : int(std::ceil(deviations * own));
                double weights = 0, sum[4] = {};
                for (int j = std::max(0, y - reach); j <= std::min(height - 1, y + reach); ++j)
                    for (int i = std::max(0, x - reach); i <= std::min(width - 1, x + reach); ++i) {
                        const double other = std::max(std::min(own, sigma.at(i, j)), 1e-2);
                        const double distance2 = double(i - x) * (i - x) + double(j - y) * (j - y);
                        const double weight =
                            distance2 == 0 ? 1
                                           : std::exp(-0.5 * distance2 / (other * other)) * other * other / (own * own);
                        for (int c = 0; c < 4; ++c) sum[c] += weight * image.at(i, j, c);
                        weights += weight;
                    }
                for (int c = 0; c < 4; ++c) result.at(x, y, c) = sum[c] / weights;
            }
    });
    return result;
}

}  // namespace virga::reference
