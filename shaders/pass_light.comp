// The light of a drop as the picture sees it: the radiance maps looked up along the directions of every 16th pixel. The
// maps are smooth, so the composite interpolates between these instead of turning every pixel into a direction.
// Reads: radiance maps. Writes: light grids.
#include "common_frame.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) uniform sampler2D dropRadiance;
layout(binding = 0, rgba32f) writeonly uniform image2D lightGrid;
#ifdef LOW_PASS
layout(binding = 5) uniform sampler2D lowPassBackground;
layout(binding = 1, rgba32f) writeonly uniform image2D lowPassGrid;
#endif

/// Place of a world direction on an equirectangular map (docs/conventions.md): +y at the top, -z in the middle column,
/// +x a quarter to the right.
vec2 equirectangular(vec3 direction)
{
    vec3 d = normalize(direction);
    return vec2(0.5 + atan(d.x, -d.z) * 0.15915494309, 0.5 - asin(clamp(d.y, -1.0, 1.0)) * 0.31830988618);
}

void main()
{
    ivec2 node = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(node, imageSize(lightGrid)))) return;
    // transpose = inverse: from camera axes to the world.
    vec3 direction = transpose(mat3(frame.cameraFromWorldOpen)) * pixelRay(vec2(node * lightGridStep));
    vec2 place = equirectangular(direction);
    imageStore(lightGrid, node, textureLod(dropRadiance, place, 0.0));
#ifdef LOW_PASS
    imageStore(lowPassGrid, node, textureLod(lowPassBackground, place, 0.0));
#endif
}
