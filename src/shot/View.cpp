#include "shot/View.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/Error.h"
#include "core/Parallel.h"
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

Window frameAt(int width, int height, double scale) noexcept
{
    const auto side = [&](int pixels) { return std::max(1, int(std::lround(pixels * scale))); };
    return {0, 0, side(width), side(height)};
}

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

ImageF proxyOf(ConstImageViewF frame, double scale)
{
    /// Frame pixels under a proxy's pixel, and how much of it each covers.
    struct Span {
        int first = 0;
        std::vector<float> shares;
    };
    const Window small = frameAt(frame.width(), frame.height(), scale);
    const auto spansOf = [&](int pixels, int count) {
        std::vector<Span> spans(static_cast<std::size_t>(count));
        for (std::size_t i = 0; i < spans.size(); ++i) {
            const double from = std::min(double(i) / scale, pixels - 1.0);
            const double to = std::clamp(double(i + 1) / scale, from + 1e-6, double(pixels));
            spans[i].first = int(from);
            for (int p = int(from); p < to; ++p)
                spans[i].shares.push_back(float((std::min(to, p + 1.0) - std::max(from, double(p))) / (to - from)));
        }
        return spans;
    };
    const std::vector<Span> columns = spansOf(frame.width(), small.width), rows = spansOf(frame.height(), small.height);
    const int channels = frame.channels();
    ImageF proxy(small.width, small.height, channels);
    parallelFor(0, proxy.height(), 8, [&](std::ptrdiff_t first, std::ptrdiff_t last) {
        std::vector<float> sums(std::size_t(frame.width()) * std::size_t(channels));
        for (auto y = int(first); y < int(last); ++y) {
            const Span& down = rows[std::size_t(y)];
            std::fill(sums.begin(), sums.end(), 0.0f);
            for (std::size_t j = 0; j < down.shares.size(); ++j) {
                const float* from = frame.row(down.first + int(j));
                for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += down.shares[j] * from[i];
            }
            for (int x = 0; x < proxy.width(); ++x) {
                const Span& across = columns[std::size_t(x)];
                for (std::size_t i = 0; i < across.shares.size(); ++i)
                    for (int c = 0; c < channels; ++c)
                        proxy.at(x, y, c) +=
                            across.shares[i] *
                            sums[(std::size_t(across.first) + i) * std::size_t(channels) + std::size_t(c)];
            }
        }
    });
    return proxy;
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
