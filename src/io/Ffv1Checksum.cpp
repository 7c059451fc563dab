#include "io/Ffv1Checksum.h"

extern "C" {
#include <libavutil/crc.h>
}

namespace virga::io {

Ffv1Checksum checkFfv1Packet(const std::uint8_t* data, std::size_t size) noexcept
{
    constexpr std::size_t footer = 8;  // size (3 bytes), error status (1), CRC (4)
    const AVCRC* table = av_crc_get_table(AV_CRC_32_IEEE);
    bool isRight = true;
    // Slices are found from the end of the packet, and have to fill it.
    for (std::size_t end = size; end > 0;) {
        if (end < footer) return Ffv1Checksum::Absent;
        const std::uint8_t* bytes = data + end - footer;
        const std::size_t slice = (std::size_t(bytes[0]) << 16 | std::size_t(bytes[1]) << 8 | bytes[2]) + footer;
        if (slice > end) return Ffv1Checksum::Absent;
        isRight = isRight && av_crc(table, 0, data + end - slice, slice) == 0;
        end -= slice;
    }
    return isRight ? Ffv1Checksum::Right : Ffv1Checksum::Wrong;
}

}  // namespace virga::io
