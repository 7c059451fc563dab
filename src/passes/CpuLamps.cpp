#include "passes/CpuLamps.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numbers>

namespace virga::passes::cpu {
namespace {

using lanes::Float;

/// airlight.glsl of eight pixels at a time.
namespace eight {
using vec3 = lanes::Vec3;
using lanes::dot;
using lanes::exp;
using lanes::length;
using lanes::max;
using lanes::min;
using lanes::pick;
using lanes::sqrt;
#pragma push_macro("VIRGA_FN")
#pragma push_macro("VIRGA_PICK")
#pragma push_macro("pick")
#undef VIRGA_FN
#undef pick
#define VIRGA_FN VIRGA_INLINE
#define VIRGA_PICK
#define float Float
#include "shared/airlight.glsl"
#undef float
#pragma pop_macro("pick")
#pragma pop_macro("VIRGA_PICK")
#pragma pop_macro("VIRGA_FN")
}  // namespace eight

/// D(theta) between the table's entries, which stand at the middles of equal steps.
glm::vec3 transferAt(const std::vector<float>& table, float theta)
{
    const std::size_t count = table.size() / 3;
    const auto entries = float(count);
    const float place = theta * std::numbers::inv_pi_v<float> * entries - 0.5f;
    const float at = place > 0 ? std::min(place, entries - 1) : 0;  // 0 for a drop in the lens, which has no direction
    const auto left = std::size_t(at), right = std::min(left + 1, count - 1);
    const float t = at - float(left);
    glm::vec3 value;
    for (std::size_t k = 0; k < 3; ++k)
        value[int(k)] = table[3 * left + k] + (table[3 * right + k] - table[3 * left + k]) * t;
    return value;
}

}  // namespace

glm::vec3 lampsInDrop(const Frame& frame, const glm::vec3& place)
{
    glm::vec3 sum(0);
    const glm::vec3 view = glm::normalize(place);
    for (const shared::PointLight& lamp : frame.lamps) {
        const glm::vec3 way = glm::vec3(lamp.place) - place;
        const float distance2 = std::max(glm::dot(way, way), lamp.place.w * lamp.place.w);  // no drop is inside a lamp
        // theta = 0 is the lamp straight behind the drop.
        const float theta = std::acos(std::clamp(glm::dot(view, way) / std::sqrt(distance2), -1.0f, 1.0f));
        sum += transferAt(frame.ringTransfer, theta) * glm::vec3(lamp.intensity) *
               (std::exp(-frame.constants.medium.x * std::sqrt(distance2)) / distance2);
    }
    return glm::min(sum, glm::vec3(1000));
}

VIRGA_SIMD void glowAroundLamps(const Frame& frame, int x, int y, int pixels, float (&glow)[3][lanes::count])
{
    const shared::FrameConstants& c = frame.constants;
    float rayX[lanes::count], depths[lanes::count];
    for (int i = 0; i < lanes::count; ++i) {
        rayX[i] = (float(x + i) + 0.5f - c.lens.z) / c.lens.x;
        depths[i] = frame.features.depth && i < pixels ? std::min(frame.depth.row(y)[x + i], c.range.y) : c.range.y;
    }
    const float rayY = -(float(y) + 0.5f - c.lens.w) / c.lens.x;
    const Float across = lanes::load(rayX);
    const Float size = lanes::sqrt(across * across + (rayY * rayY + 1.0f));
    const Float distance = lanes::load(depths) * size;
    const glm::mat4& m = c.cameraFromWorldOpen;  // its transpose takes rays to the world
    const auto turned = [&](int axis) __attribute__((always_inline))
    {
        return (across * m[axis][0] + (rayY * m[axis][1] - m[axis][2])) / size;
    };
    const lanes::Vec3 direction(turned(0), turned(1), turned(2));
    Float sum[3] = {0.0f, 0.0f, 0.0f};
    for (const shared::PointLight& lamp : frame.lamps) {
        const lanes::Vec3 place(lamp.place.x, lamp.place.y, lamp.place.z);
        const Float light =
            eight::airlightQuadrature(direction, distance, place, Float(lamp.place.w), Float(c.medium.x));
        for (int k = 0; k < 3; ++k) sum[k] = sum[k] + light * lamp.intensity[k];
    }
    for (int k = 0; k < 3; ++k) lanes::store(sum[k], glow[k]);
}

}  // namespace virga::passes::cpu
