// What the alignment draws at random: a hash of a number (docs/conventions.md, "Random numbers"), so that any number of
// threads draws the same.
#pragma once

#include <cstdint>

namespace virga::matte::alignment {

/// lowbias32 (Wellons 2018): a bijection in which every bit of the result depends on every bit of x.
inline std::uint32_t hashed(std::uint32_t x)
{
    x = (x ^ (x >> 16)) * 0x7FEB352Du;
    x = (x ^ (x >> 15)) * 0x846CA68Bu;
    return x ^ (x >> 16);
}

}  // namespace virga::matte::alignment
