#pragma once

#include "passes/FrameTargets.h"

namespace virga::passes {

/// The picture: plate (graded here unless the blur did), fog, splashes and rain over each other. Reads everything that
/// the features name; writes the beauty and, if asked, the layers; empties the accumulators for the next frame.
class CompositePass {
public:
    CompositePass(const Features& features, const gl::ShaderPlaces& places = {});
    void run(const FrameTargets& targets) const;

private:
    gl::Program program_;
};

}  // namespace virga::passes
