#pragma once

namespace virga::shot {

/// What is left out because the picture is the same without it (docs/skipping.md). All of it always is; tests and
/// bench_skip turn one off at a time to compare pictures and times. What else is skipped (files that nothing looks at,
/// the device of a pass-through) has no such switch, as there would be nothing to do with it.
struct Skips {
    bool passes = true;       ///< effects that change nothing have no pass, no buffers and no part in the shaders
    bool outOfView = true;    ///< cells of drops that the camera does not see
    bool faint = true;        ///< cells of drops too small or too far for --threshold
    bool behindDepth = true;  ///< cells of drops that the scene stands in front of
    bool farLamps = true;     ///< lamps of whose light nothing arrives (LampReach.h: within 1e-6)
    bool unchanged = true;    ///< a plate, and the light made from it, that is what it was in the frame before
};

}  // namespace virga::shot
