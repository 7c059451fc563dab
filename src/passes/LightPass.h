#pragma once

#include <glm/mat3x3.hpp>

#include "passes/FrameTargets.h"

namespace virga::passes {

/// Looks the light of drops up along the picture's directions. Reads: the radiance maps. Writes: the light grids.
class LightPass {
public:
    LightPass(const Features& features, const gl::ShaderPlaces& places = {});

    /// environmentFromWorld  a rotation: the maps' direction of a direction in the world. An environment turns without
    ///                       being baked again
    void run(const FrameTargets& targets, const glm::mat3& environmentFromWorld = glm::mat3(1.0f)) const;

private:
    gl::Program program_;
};

}  // namespace virga::passes
