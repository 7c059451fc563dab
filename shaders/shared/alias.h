// Lets C++ compile the files in shaders/shared/ as they are: GLSL's vector types from GLM.
#pragma once

#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#define VIRGA_FN inline

namespace virga::shared {
using glm::mat4;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using uint = unsigned int;
using glm::dot;
using glm::exp;
using glm::log;
using glm::abs;
using glm::fract;
using glm::length;
using glm::max;
using glm::min;
using glm::sqrt;
}  // namespace virga::shared
