// What of a frame somebody asks for: a part of it, at a scale.
#pragma once

#include "core/Image.h"
#include "core/Watch.h"
#include "core/Window.h"

namespace virga::shot {

/// All of a frame of width x height pixels at a scale of it: each side rounded, a pixel at least.
Window frameAt(int width, int height, double scale) noexcept;

/// Pixels of a view are those of the frame at `scale` (frameAt); pixel (x, y) of it
/// covers [x, x + 1) / scale of the frame's. The lens's axis stays on the frame's middle.
struct View {
    double scale = 1;  ///< of each side, in (0, 1]: a proxy
    Window region{};   ///< to be made, may reach beyond the frame; empty: the whole frame
    Window plate{};  ///< what of the plate is given; empty: the whole frame, or the region where that reaches beyond it

    double later = 0;  ///< the shutter opens so many frames after the frame begins, 0 to 1: for what is retimed

    friend bool operator==(const View&, const View&) = default;
};

/// The windows of a view, all in its pixels.
struct ViewWindows {
    double scale = 1;
    Window frame;   ///< all of it
    Window region;  ///< what is asked for
    Window plate;   ///< what is given of the plate
    Window needed;  ///< what is needed of it: the region, and what a blur spreads into it
    Window drawn;   ///< what is drawn so that the region comes out as in a whole frame
};

/// frame: at the view's scale. blurReach, splashReach: how far around a pixel something adds to it [px].
/// Throws Error(InvalidArgument) for a scale that is not in (0, 1], a region of more than 16384 pixels a side or of
/// none, and a plate that lacks pixels.
ViewWindows windowsOf(const View& view, const Window& frame, int blurReach, int splashReach);

/// The frame at the scale: each pixel is the mean of what it covers; what reaches beyond the frame's border repeats it.
/// Parallel over rows.
ImageF proxyOf(ConstImageViewF frame, double scale);

/// The pixels of `wants` out of an image of `has`, 0 where it has none. Moves if both are the same.
ImageF placed(ImageF image, const Window& has, const Window& wants);

}  // namespace virga::shot
