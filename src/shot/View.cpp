#include "shot/View.h"

#include <algorithm>
#include <utility>

#include "core/Error.h"
#include "passes/LightGrid.h"

namespace virga::shot {
namespace {

constexpr int mostPixels = 16384;       // a side: what OpenGL 4.5 promises for textures
constexpr int farthestPixel = 1 << 20;  // from the frame's corner

Window grown(const Window& w, int by) { return {w.x - by, w.y - by, w.width + 2 * by, w.height + 2 * by}; }

/// Grids of light and blocks of splashes begin at the frame's corner, and so do those of a part that begins at a
/// multiple of their step: then it has the frame's own values. Beyond the frame nothing is compared.
int alignedDown(int x) { return x < 0 ? x : x / passes::coarsestLightGrid * passes::coarsestLightGrid; }

void check(const View& view)
{
    if (!(view.scale > 0 && view.scale <= 1))
        throw Error(ErrorCode::InvalidArgument, "scale {:g}: must be over 0 and at most 1", view.scale);
    if (!(view.later >= 0 && view.later < 1))
        throw Error(ErrorCode::InvalidArgument, "{:g} frames later: must be 0 to under 1", view.later);
    for (const Window& w : {view.region, view.plate}) {
        if (w == Window{}) continue;
        if (w.width < 1 || w.height < 1 || w.width > mostPixels || w.height > mostPixels ||
            std::max({std::abs(w.x), std::abs(w.y)}) > farthestPixel)
            throw Error(ErrorCode::InvalidArgument,
                        "region {},{} {}x{}: must have 1 to {} pixels a side, at most {} from the frame's corner", w.x,
                        w.y, w.width, w.height, mostPixels, farthestPixel);
    }
}

}  // namespace

ViewWindows windowsOf(const View& view, const Window& frame, int blurReach, int splashReach)
{
    check(view);
    ViewWindows windows;
    windows.scale = view.scale;
    windows.frame = frame;
    windows.region = view.region.isEmpty() ? frame : view.region;
    const bool isInside = frame.contains(windows.region);
    windows.plate = !view.plate.isEmpty() ? view.plate : isInside ? frame : windows.region;
    // A picture ends where the plate does: what the region does not ask for beyond the frame is not there.
    const auto within = [&](const Window& w) {
        const Window most = isInside ? frame : united(frame, windows.region);
        return overlap(w, most);
    };
    windows.needed = isInside ? within(grown(windows.region, blurReach)) : windows.region;
    if (!windows.plate.contains(windows.needed))
        throw Error(ErrorCode::InvalidArgument,
                    "region {},{} {}x{}: needs the plate's pixels {},{} {}x{}, but {},{} {}x{} are given",
                    windows.region.x, windows.region.y, windows.region.width, windows.region.height, windows.needed.x,
                    windows.needed.y, windows.needed.width, windows.needed.height, windows.plate.x, windows.plate.y,
                    windows.plate.width, windows.plate.height);
    if (!isInside) {
        windows.drawn = windows.region;
        return windows;
    }
    const Window drawn = within(grown(windows.region, std::max(blurReach, splashReach)));
    const int x = alignedDown(drawn.x), y = alignedDown(drawn.y);
    windows.drawn = {x, y, drawn.right() - x, drawn.bottom() - y};
    return windows;
}

ImageF placed(ImageF image, const Window& has, const Window& wants)
{
    if (has == wants) return image;
    ImageF result(wants.width, wants.height, image.channels());
    const Window both = overlap(has, wants);
    const auto channels = std::size_t(image.channels());
    for (int y = both.y; y < both.bottom() && both.width > 0; ++y)
        std::copy_n(image.pixel(both.x - has.x, y - has.y), std::size_t(both.width) * channels,
                    result.pixel(both.x - wants.x, y - wants.y));
    return result;
}

}  // namespace virga::shot
