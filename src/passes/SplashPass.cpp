#include "passes/SplashPass.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace virga::passes {
namespace {

constexpr int block = 4 * 8;  // pixels a work group's edge: blockSize times the group's invocations

gl::Defines definesOf(const Features& features)
{
    gl::Defines defines;
    if (features.fog) defines.emplace_back("FOG", "");
    if (features.lights) defines.emplace_back("LIGHTS", "");
    return defines;
}

}  // namespace

SplashPass::SplashPass(const Features& features, const gl::ShaderPlaces& places)
    : emit_("pass_emit_splashes.comp", definesOf(features), places),
      splat_("pass_splat_splashes.comp", definesOf(features), places), list_(4 * sizeof(std::uint32_t))
{
}

std::size_t SplashPass::capacity(int width, int height)
{
    return std::max<std::size_t>(std::size_t(width) * std::size_t(height) / 4, 1024);
}

void SplashPass::run(const FrameTargets& targets)
{
    constexpr std::array<std::uint32_t, 4> noSplashes = {0, 1, 1, 0};
    list_.upload(noSplashes.data(), sizeof noSplashes);
    list_.bindStorage(SplashListIndex);
    splashes_.reserve(capacity(targets.width(), targets.height()) * sizeof(shared::Splash));
    splashes_.bindStorage(SplashesIndex);
    emit_.dispatch(gl::groupsFor(targets.width(), block), gl::groupsFor(targets.height(), block));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT);
    splat_.dispatchIndirect(list_.name(), 0);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
}

std::size_t SplashPass::splashCount() const
{
    std::array<std::uint32_t, 4> list{};
    list_.download(list.data(), sizeof list);
    return list[3];
}

void SplashPass::copyCount(GLuint buffer, std::size_t offset) const
{
    glCopyNamedBufferSubData(list_.name(), buffer, 0, GLintptr(offset), GLsizeiptr(countBytes));
}

std::size_t SplashPass::splashesIn(const void* count)
{
    std::array<std::uint32_t, 4> list{};
    std::memcpy(list.data(), count, sizeof list);
    return list[3];
}

}  // namespace virga::passes
