// Rain over what a plate shows beyond its frame (an EXR's data window beyond its display window).
#pragma once

#include <exception>
#include <memory>

#include "io/BackgroundQueue.h"
#include "shot/Compositor.h"

namespace virga::shot {

/// How far around the frame there is something to render.
struct Margins {
    int x = 0, y = 0;  ///< on each side [px]
    bool isEmpty() const { return x == 0 && y == 0; }
};

/// A second compositor, of the frame with margins about it, whose frame itself is thrown away: the one that renders the
/// frame alone is not touched by what lies around it, so the picture is the same, bit for bit, with overscan and
/// without. Both have the same camera and light; at the seam they differ by what rounding does, and by what a blur of
/// the frame cannot see of its surroundings. It lives on a thread of its own, as a device does.
class OverscanRenderer {
public:
    /// shot: of the frame. Throws what Compositor throws.
    OverscanRenderer(const Settings& settings, const Shot& shot, const Margins& margins,
                     const CompositorOptions& options, const PlateSamples& samples);
    ~OverscanRenderer();

    /// Begins, and returns at once. The frame is not kept.
    void begin(const io::PlateFrame& frame);
    /// What was begun last: the frame with its margins. Throws what rendering threw.
    ImageF finish();

private:
    void run(std::function<void()> job);
    void wait();

    Margins margins_;
    View view_;                               // the frame with its margins
    std::unique_ptr<Compositor> compositor_;  // made, used and destroyed on the queue's thread
    ImageF result_;
    std::exception_ptr problem_;
    io::BackgroundQueue queue_{1, 2};
};

}  // namespace virga::shot
