#include "shot/PixelRepair.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/Parallel.h"
#include "core/Simd.h"

namespace virga::shot {
namespace {

/// Whether all are finite: no exponent has all bits set. Without a branch, as nearly all are.
VIRGA_SIMD bool areFinite(const float* values, std::size_t count)
{
    constexpr std::uint32_t exponent = 0x7f800000;
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < count; ++i)
        found |= std::uint32_t((std::bit_cast<std::uint32_t>(values[i]) & exponent) == exponent);
    return found == 0;
}

}  // namespace

std::size_t repairRows(ImageView<float> rows)
{
    std::size_t repaired = 0;
    const auto count = std::size_t(rows.width()) * std::size_t(rows.channels());
    for (int y = 0; y < rows.height(); ++y) {
        float* row = rows.row(y);
        if (areFinite(row, count)) continue;
        for (std::size_t x = 0; x < count; ++x) {
            if (std::isfinite(row[x])) continue;
            row[x] = row[x] > 0 ? 65504.0f : 0.0f;  // NaN compares false
            ++repaired;
        }
    }
    return repaired;
}

std::size_t repairPixels(ImageF& image)
{
    std::atomic<std::size_t> repaired = 0;
    parallelFor(0, image.height(), 16, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        repaired += repairRows(rowsOf(image.view(), int(first), int(last)));
    });
    return repaired;
}

}  // namespace virga::shot
