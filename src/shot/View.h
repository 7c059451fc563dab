// What of a frame somebody asks for: a part of it, at a scale.
#pragma once

#include <functional>

#include "core/Window.h"

namespace virga::shot {

/// Pixels of a view are those of the frame at `scale`: round(width * scale) x round(height * scale), pixel (x, y) of it
/// covers [x, x + 1) / scale of the frame's. The lens's axis stays on the frame's middle.
struct View {
    double scale = 1;  ///< of each side, in (0, 1]: a proxy
    Window region{};   ///< to be made, may reach beyond the frame; empty: the whole frame
    Window plate{};    ///< what of the plate is given; empty: the whole frame, or the region where that reaches beyond it

    friend bool operator==(const View&, const View&) = default;
};

/// Told, on the thread that renders, what share of a frame is done, 0 to 1. False: the frame is wanted no longer, and
/// rendering it throws Error(Interrupted).
using Watch = std::function<bool(double)>;

}  // namespace virga::shot
