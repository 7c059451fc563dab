// Lamps in the scene: what a drop returns of them, and the airlight around them.
#ifdef LIGHTS
#include "shared/airlight.glsl"

layout(std430, binding = 15) readonly buffer Lights { PointLight lights[]; };
/// D(theta) of the drop [1/sr], RGB, at theta = 0 .. pi (optics/DropTransfer.h).
layout(binding = 7) uniform sampler2D ringTransfer;

/// Radiance of a drop at `place` (from the camera, world axes [m]): of each lamp the share D(theta) of what arrives.
vec3 lampsInDrop(vec3 place)
{
    vec3 sum = vec3(0.0);
    vec3 view = normalize(place);
    for (uint n = 0u; n < frame.lights.x; ++n) {
        vec3 way = lights[n].place.xyz - place;
        float distance2 = max(dot(way, way), lights[n].place.w * lights[n].place.w);  // no drop is inside a lamp
        // theta = 0 is the lamp straight behind the drop.
        float theta = acos(clamp(dot(view, way) * inversesqrt(distance2), -1.0, 1.0));
        vec3 share = textureLod(ringTransfer, vec2(theta * 0.31830988618, 0.5), 0.0).rgb;
        sum += share * lights[n].intensity.rgb * (exp(-frame.medium.x * sqrt(distance2)) / distance2);
    }
    return min(sum, vec3(1000.0));
}
#endif
