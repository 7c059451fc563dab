// Maps looked up by the light pass itself, along directions of a test's own.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "core/Image.h"
#include "gl/Objects.h"
#include "gl/Program.h"

namespace virga::test {

class ShaderLookup {
public:
    ShaderLookup() : program_("pass_light.comp", {{"DIRECTIONS", ""}}) {}

    /// rgb of each direction in the world.
    std::vector<glm::vec4> operator()(ConstImageViewF map, const std::vector<glm::vec3>& directions,
                                      const glm::mat3& environmentFromWorld = glm::mat3(1.0f)) const
    {
        gl::Texture texture = gl::Texture::make2D(GL_RGB32F, map.width(), map.height());
        texture.setFilter(GL_NEAREST);
        texture.upload(GL_RGB, GL_FLOAT, map.data());
        std::vector<glm::vec4> values;
        for (const glm::vec3& d : directions) values.emplace_back(d, 0.0f);
        const gl::Buffer buffer(values.size() * sizeof(glm::vec4), GL_DYNAMIC_STORAGE_BIT, values.data());
        texture.bind(4);
        buffer.bindStorage(1);
        glProgramUniformMatrix3fv(program_.name(), 0, 1, GL_FALSE, glm::value_ptr(environmentFromWorld));
        program_.dispatch(32, gl::groupsFor(int(values.size()), 32 * 64));
        glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
        buffer.download(values.data(), buffer.bytes());
        return values;
    }

private:
    gl::Program program_;
};

/// Scattered unit vectors, a golden spiral, after the places where a lookup may go wrong: the axes, and beside them the
/// poles and the seam at +z.
inline std::vector<glm::vec3> scatteredDirections(int count)
{
    std::vector<glm::vec3> result;
    for (const float a : {-1.0f, 1.0f})
        for (const glm::vec3& axis : {glm::vec3(a, 0, 0), glm::vec3(0, a, 0), glm::vec3(0, 0, a)}) {
            result.push_back(axis);
            for (const float off : {1e-7f, 1e-4f, -3e-3f}) {
                result.push_back(glm::normalize(axis + glm::vec3(off, 0.5f * off, -off)));
                result.push_back(glm::normalize(axis + glm::vec3(-off, 0, 0.7f * off)));
            }
        }
    for (int i = int(result.size()); i < count; ++i) {
        const double y = 1.0 - 2.0 * (i + 0.5) / count, azimuth = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
        const double s = std::sqrt(1.0 - y * y);
        result.emplace_back(s * std::sin(azimuth), y, -s * std::cos(azimuth));
    }
    return result;
}

}  // namespace virga::test
