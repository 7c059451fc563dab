#include "passes/LightPass.h"

#include <glm/gtc/type_ptr.hpp>

namespace virga::passes {

LightPass::LightPass(const Features& features, const gl::ShaderPlaces& places)
    : program_("pass_light.comp", features.lowPass() ? gl::Defines{{"LOW_PASS", ""}} : gl::Defines{}, places)
{
}

void LightPass::run(const FrameTargets& targets, const glm::mat3& environmentFromWorld) const
{
    constexpr GLint rotationLocation = 0;
    glProgramUniformMatrix3fv(program_.name(), rotationLocation, 1, GL_FALSE, glm::value_ptr(environmentFromWorld));
    targets.bindLightMaps();
    targets.lightGrid.bindImage(0, GL_WRITE_ONLY);
    if (targets.lowPassGrid) targets.lowPassGrid.bindImage(1, GL_WRITE_ONLY);
    program_.dispatch(gl::groupsFor(targets.lightGrid.width(), 8), gl::groupsFor(targets.lightGrid.height(), 8));
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
    targets.lightGrid.bind(DropRadianceUnit);
    if (targets.lowPassGrid) targets.lowPassGrid.bind(LowPassUnit);
}

}  // namespace virga::passes
