#pragma once

#include "passes/FrameTargets.h"

namespace virga::passes {

/// Draws what drops leave where they hit surfaces that face up. Reads: depth, fog table. Writes: the splash
/// accumulators (optical depth, and the same weighted with the light that the fog lets through).
class SplashPass {
public:
    SplashPass(const Features& features, const gl::ShaderPlaces& places = {});

    /// Splashes that a picture of this size can list; more than can be told apart.
    static std::size_t capacity(int width, int height);

    void run(const FrameTargets& targets);
    std::size_t splashCount() const;  ///< of the last run(); waits for it
    /// As StrokePass's.
    void copyCount(GLuint buffer, std::size_t offset) const;
    static constexpr std::size_t countBytes = 4 * sizeof(std::uint32_t);
    static std::size_t splashesIn(const void* count);

    std::size_t bytes() const { return splashes_.bytes() + list_.bytes(); }  ///< on the device

private:
    gl::Program emit_, splat_;
    gl::Buffer splashes_, list_;
};

}  // namespace virga::passes
