// Rows of floats as halves (IEEE 754 binary16).
#pragma once

#include <cstddef>
#include <cstdint>

namespace virga::io {

/// Rounds to nearest; finite values too large become +-65504, and their number is returned. NaN keeps its payload as
/// far as it fits. Source and target step by `fromStep` floats and `toStep` bytes.
std::size_t halvesFromFloats(const float* from, std::size_t fromStep, std::byte* to, std::size_t toStep,
                             std::size_t count) noexcept;
void floatsFromHalves(const std::uint16_t* from, float* to, std::size_t count) noexcept;

}  // namespace virga::io
