#pragma once

#include "passes/FrameTargets.h"

namespace virga::passes {

/// Looks the light of drops up along the picture's directions. Reads: the radiance maps. Writes: the light grids.
class LightPass {
public:
    LightPass(const Features& features, const std::string& shaderFolder = {});
    void run(const FrameTargets& targets) const;

private:
    gl::Program program_;
};

}  // namespace virga::passes
