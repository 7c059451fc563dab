#include "passes/BlurPass.h"

namespace virga::passes {
namespace {

gl::Defines definesOf(const Features& features, bool horizontal)
{
    gl::Defines defines;
    if (features.depth) defines.emplace_back("DEPTH", "");
    if (!horizontal) return defines;
    defines.emplace_back("HORIZONTAL", "");
    if (features.darken) defines.emplace_back("DARKEN", "");
    if (features.colorTransfer) defines.emplace_back("COLOR_TRANSFER", "");
    return defines;
}

}  // namespace

BlurPass::BlurPass(const Features& features, const gl::ShaderPlaces& places)
    : horizontal_("pass_blur.comp", definesOf(features, true), places),
      vertical_("pass_blur.comp", definesOf(features, false), places)
{
}

void BlurPass::run(const FrameTargets& targets) const
{
    const auto step = [&](const gl::Program& program, const gl::Texture& from, const gl::Texture& to) {
        from.bind(PlateUnit);
        to.bindImage(0, GL_WRITE_ONLY);
        program.dispatch(gl::groupsFor(targets.width(), 16), gl::groupsFor(targets.height(), 16));
        glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    };
    step(horizontal_, targets.plate, targets.blurA);
    step(vertical_, targets.blurA, targets.blurB);
}

}  // namespace virga::passes
