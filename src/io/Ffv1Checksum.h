#pragma once

#include <cstddef>
#include <cstdint>

namespace virga::io {

/// Checksums in the packets of FFV1 version 3 (RFC 9043, 4.10: each slice ends with its size, a status and a CRC).
/// FFmpeg's decoder notes a wrong one in its log and hands out the picture as if it were good; here it is told.
enum class Ffv1Checksum {
    Absent,  ///< the packet has no such structure: older version, made without checksums, or badly damaged
    Right,
    Wrong
};
Ffv1Checksum checkFfv1Packet(const std::uint8_t* data, std::size_t size) noexcept;

}  // namespace virga::io
