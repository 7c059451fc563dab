#pragma once

#include "passes/FrameTargets.h"

namespace virga::passes {

/// Grades and blurs the plate with a Gaussian that grows with depth, edges of depth kept. Reads: plate, depth, LUT.
/// Writes: FrameTargets::blurB, which the composite then takes for the plate.
class BlurPass {
public:
    BlurPass(const Features& features, const gl::ShaderPlaces& places = {});
    void run(const FrameTargets& targets) const;

private:
    gl::Program horizontal_, vertical_;
};

}  // namespace virga::passes
