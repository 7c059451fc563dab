// The light of a drop as the picture sees it: the radiance maps looked up along the directions of every few pixels
// (FrameTargets::lightGridStep). The composite interpolates between these instead of turning every pixel into a
// direction. Reads: radiance maps. Writes: light grids.
// DIRECTIONS, for tests: along a list of directions in the world instead; the answers take their places.
#include "common_frame.glsl"
#include "common_environment.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 4) uniform sampler2D dropRadiance;
/// Axes of the maps from axes of the world.
layout(location = 0) uniform mat3 environmentFromWorld;

vec3 environmentDirection(vec3 world) { return environmentFromWorld * world; }

#ifdef DIRECTIONS
layout(std430, binding = 1) buffer Directions { vec4 directions[]; };

void main()
{
    uint i = gl_GlobalInvocationID.y * gl_NumWorkGroups.x * 8u + gl_GlobalInvocationID.x;
    if (i >= uint(directions.length())) return;
    directions[i].rgb = sampleEquirectangular(dropRadiance, environmentDirection(directions[i].xyz));
}
#else
layout(binding = 0, rgba32f) writeonly uniform image2D lightGrid;
#ifdef LOW_PASS
layout(binding = 5) uniform sampler2D lowPassBackground;
layout(binding = 1, rgba32f) writeonly uniform image2D lowPassGrid;
#endif

void main()
{
    ivec2 node = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(node, imageSize(lightGrid)))) return;
    // transpose = inverse: from camera axes to the world.
    vec3 world = transpose(mat3(frame.cameraFromWorldOpen)) * pixelRay(vec2(node) * float(frame.lights.y));
    vec3 direction = environmentDirection(world);
    imageStore(lightGrid, node, vec4(sampleEquirectangular(dropRadiance, direction), 1.0));
#ifdef LOW_PASS
    imageStore(lowPassGrid, node, vec4(sampleEquirectangular(lowPassBackground, direction), 1.0));
#endif
}
#endif
