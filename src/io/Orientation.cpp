#include "io/Orientation.h"

extern "C" {
#include <libavformat/avformat.h>
#include <libavutil/display.h>
}

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "core/Log.h"
#include "core/Parallel.h"

namespace virga::io {

const char* Orientation::words() const
{
    static constexpr const char* upright[] = {"upright", "mirrored top to bottom", "mirrored left to right",
                                              "turned by 180 degrees"};
    // Exchanged rows and columns are a mirror about the diagonal; one more mirror makes it a turn.
    static constexpr const char* swapped[] = {"mirrored about the falling diagonal",
                                              "turned by 90 degrees counterclockwise", "turned by 90 degrees clockwise",
                                              "mirrored about the rising diagonal"};
    return (swap ? swapped : upright)[(reverseX ? 2 : 0) + (reverseY ? 1 : 0)];
}

Orientation orientationOf(const AVStream* stream, const std::string& name)
{
    const std::uint8_t* data = av_stream_get_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
    if (data == nullptr) return {};
    std::int32_t m[9];
    std::memcpy(m, data, sizeof m);
    // shown x = m0 * x + m3 * y, shown y = m1 * x + m4 * y
    if (m[1] == 0 && m[3] == 0 && m[0] != 0 && m[4] != 0) return {false, m[0] < 0, m[4] < 0};
    if (m[0] == 0 && m[4] == 0 && m[1] != 0 && m[3] != 0) return {true, m[3] < 0, m[1] < 0};
    log::warning("{}: asks to be shown turned by {:.1f} degrees, which is no quarter turn; left as it is", name,
                 -av_display_rotation_get(m));
    return {};
}

void orient(const ImageF& coded, const Orientation& orientation, ImageF& shown)
{
    const std::size_t pixelBytes = std::size_t(coded.channels()) * sizeof(float);
    constexpr int tile = 16;
    parallelFor(0, (shown.height() + tile - 1) / tile, 1, [&](std::ptrdiff_t firstTile, std::ptrdiff_t lastTile) {
        const int top = int(firstTile) * tile, bottom = std::min(int(lastTile) * tile, shown.height());
        for (int left = 0; left < shown.width(); left += tile) {
            for (int y = top; y < bottom; ++y) {
                for (int x = left; x < std::min(left + tile, shown.width()); ++x) {
                    const int u = orientation.reverseX ? shown.width() - 1 - x : x;
                    const int v = orientation.reverseY ? shown.height() - 1 - y : y;
                    std::memcpy(shown.pixel(x, y), orientation.swap ? coded.pixel(v, u) : coded.pixel(u, v),
                                pixelBytes);
                }
            }
        }
    });
}

}  // namespace virga::io
