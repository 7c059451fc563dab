#include "io/HalfRow.h"

#include <Imath/half.h>

#include <cmath>
#include <cstring>

namespace virga::io {

std::size_t halvesFromFloats(const float* from, std::size_t fromStep, std::byte* to, std::size_t toStep,
                             std::size_t count) noexcept
{
    std::size_t held = 0;
    for (std::size_t i = 0; i < count; ++i, from += fromStep, to += toStep) {
        std::uint16_t bits = imath_float_to_half(*from);
        if ((bits & 0x7fff) == 0x7c00 && std::isfinite(*from)) {
            bits = std::uint16_t((bits & 0x8000) | 0x7bff);
            ++held;
        }
        std::memcpy(to, &bits, sizeof bits);
    }
    return held;
}

void floatsFromHalves(const std::uint16_t* from, float* to, std::size_t count) noexcept
{
    for (std::size_t i = 0; i < count; ++i) to[i] = imath_half_to_float(from[i]);
}

}  // namespace virga::io
