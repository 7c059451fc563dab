#pragma once

#include "gl/PassTimer.h"
#include "matte/StrokeAtlas.h"
#include "particles/RainField.h"
#include "passes/FrameTargets.h"

namespace virga::passes {

/// Draws the drops that are seen one by one.
/// Reads: the cells in view, the atlas; of the targets, depth and fog table. Writes: the accumulators (optical depth of
/// the rain in fixed point, and the same weighted with the light that the fog lets through); nearest depth and motion.
/// Two steps: drops become strokes, culled (one invocation a drop), then strokes are splatted with integer atomics, so
/// that the sums are the same bits in whatever order the device adds them. Built once, run per frame.
class StrokePass {
public:
    /// places: see gl::loadShader. Throws Error(Graphics).
    StrokePass(const Features& features, const matte::StrokeAtlas& atlas, const gl::ShaderPlaces& places = {});

    /// Fills what the constants say of the atlas and the list; call before FrameTargets::setConstants.
    void describe(shared::FrameConstants& constants, const particles::CellList& list) const;

    /// Marks "drops" and "strokes" on the timer.
    void run(const FrameTargets& targets, const particles::CellList& list, gl::PassTimer& timer);

    /// Strokes of the last run(); waits for it.
    std::size_t strokeCount() const;
    /// The same without waiting: copies what strokesIn() reads into a buffer, after the run.
    void copyCount(GLuint buffer, std::size_t offset) const;
    static constexpr std::size_t countBytes = 8 * sizeof(std::uint32_t);
    static std::size_t strokesIn(const void* count);

    std::size_t bytes() const  ///< of its buffers and mattes, on the device
    {
        return cells_.bytes() + blocks_.bytes() + classes_.bytes() + strokes_.bytes() + lists_.bytes() +
               alongPrefix_.bytes() + mattes_.bytes();
    }

private:
    void splat(const gl::Program& small, const gl::Program& large) const;

    Features features_;
    matte::StrokeAtlas atlas_;
    gl::Program emit_, splatSmall_, splatLarge_, motionSmall_, motionLarge_;
    gl::Buffer cells_, blocks_, classes_, strokes_, lists_, alongPrefix_;
    gl::Texture mattes_;
};

}  // namespace virga::passes
