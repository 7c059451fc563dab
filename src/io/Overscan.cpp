// What a plate shows beyond its frame, above and below io.

#include "io/Overscan.h"

#include <algorithm>

namespace virga::io {

ImageF withOverscan(const PlateFrame& frame, int x, int y)
{
    const int width = frame.pixels.width(), height = frame.pixels.height();
    ImageF wide(width + 2 * x, height + 2 * y, 4);
    const auto place = [&](const ImageF& pixels, const Window& at, const Window& whole) {
        const Window both = overlap(at, whole);
        for (int v = both.y; v < both.bottom() && both.width > 0; ++v)
            std::copy_n(pixels.pixel(both.x - at.x, v - at.y), 4 * std::size_t(both.width),
                        wide.pixel(both.x - whole.x, v - whole.y));
    };
    const Window display = frame.extras ? frame.extras->file.display : Window{0, 0, width, height};
    const Window whole{display.x - x, display.y - y, wide.width(), wide.height()};
    if (frame.extras && !frame.extras->file.overscan.empty())
        place(frame.extras->file.overscan, frame.extras->file.data, whole);
    place(frame.pixels, {display.x, display.y, width, height}, whole);
    return wide;
}

void takeOverscan(ConstImageViewF wide, const PlateFile& file, ImageF& overscan)
{
    const Window& display = file.display;
    const Window whole{display.x - (wide.width() - display.width) / 2, display.y - (wide.height() - display.height) / 2,
                       wide.width(), wide.height()};
    const Window both = overlap(file.data, whole);
    for (int y = both.y; y < both.bottom() && both.width > 0; ++y)
        std::copy_n(wide.pixel(both.x - whole.x, y - whole.y), 4 * std::size_t(both.width),
                    overscan.pixel(both.x - file.data.x, y - file.data.y));
}

}  // namespace virga::io
