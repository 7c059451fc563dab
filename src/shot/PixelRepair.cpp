#include "shot/PixelRepair.h"

#include <atomic>
#include <cmath>

#include "core/Parallel.h"

namespace virga::shot {

std::size_t repairPixels(ImageF& image)
{
    std::atomic<std::size_t> repaired = 0;
    parallelFor(0, image.height(), 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::size_t here = 0;
        for (std::ptrdiff_t y = first; y < last; ++y) {
            float* row = image.row(int(y));
            for (int x = 0; x < 4 * image.width(); ++x) {
                if (std::isfinite(row[x])) continue;
                row[x] = row[x] > 0 ? 65504.0f : 0.0f;  // NaN compares false
                ++here;
            }
        }
        repaired += here;
    });
    return repaired;
}

}  // namespace virga::shot
