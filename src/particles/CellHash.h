// 64-bit hashing of cells, on the CPU. What happens inside a cell is hashed in shaders/shared/drop_field.glsl.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace virga::particles {

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection in which every bit depends on every bit.
constexpr std::uint64_t mix(std::uint64_t x) noexcept
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/// [0, 1) with 53 bits.
constexpr double unitDouble(std::uint64_t bits) noexcept { return double(bits >> 11) * 0x1p-53; }

/// Hash of a cell. Indices wrap at 2^64, far beyond any place that double coordinates can tell apart.
constexpr std::uint64_t cellHash(std::uint64_t seed, std::int64_t dropClass, std::int64_t i, std::int64_t j,
                                 std::int64_t k) noexcept
{
    std::uint64_t h = mix(seed ^ 0x5261696e46616c6cu);
    for (const std::int64_t part : {dropClass, i, j, k}) h = mix(h ^ std::uint64_t(part));
    return h;
}

}  // namespace virga::particles
