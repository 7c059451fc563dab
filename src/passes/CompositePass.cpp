#include "passes/CompositePass.h"

namespace virga::passes {
namespace {

gl::Defines definesOf(const Features& features)
{
    gl::Defines defines;
    const auto add = [&](bool wanted, const char* word) {
        if (wanted) defines.emplace_back(word, "");
    };
    add(features.rain, "RAIN");
    add(features.fog, "FOG");
    add(features.veil, "VEIL");
    add(features.depth, "DEPTH");
    add(features.splashes, "SPLASHES");
    add(features.blur, "BLURRED");
    add(features.darken, "DARKEN");
    add(features.colorTransfer, "COLOR_TRANSFER");
    add(features.boost, "BOOST");
    add(features.lights, "LIGHTS");
    add(features.layers, "LAYERS");
    return defines;
}

}  // namespace

CompositePass::CompositePass(const Features& features, const gl::ShaderPlaces& places)
    : program_("pass_composite.comp", definesOf(features), places)
{
}

void CompositePass::run(const FrameTargets& targets) const
{
    (targets.features().blur ? targets.blurB : targets.plate).bind(PlateUnit);
    program_.dispatch(gl::groupsFor(targets.width(), 16), gl::groupsFor(targets.height(), 16));
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
}

}  // namespace virga::passes
