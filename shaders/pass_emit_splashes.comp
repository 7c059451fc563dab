// Drops that hit what faces up. A block of pixels that shows such a surface asks which impacts of the last moments, in
// the cells of a horizontal grid that it covers, project into it; the one block that an impact falls into draws it.
// Impacts are hashed by (seed, cell, time slot), so they stand in the world and any frame can be made alone.
// Reads: depth, fog table. Writes: a list of splashes.
#include "common_frame.glsl"
#include "shared/drop_field.glsl"
#include "shared/splash.glsl"
#include "common_lights.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 1) uniform sampler2D sceneDepth;
#ifdef FOG
layout(binding = 2) uniform sampler2D fogTable;
#endif
layout(std430, binding = 12) writeonly buffer Splashes { Splash splashes[]; };
layout(std430, binding = 13) buffer SplashList { uint splashGroups, splashY, splashZ, splashCount; };

const int blockSize = 4;          // pixels along the edge of a block
const float faceUp = 0.7;         // least cosine between the surface's normal and up
const float atEdge = 0.04;        // bend of inverse depth over a block, relative, that is taken for an edge
const uint mostPerCell = 16u;
const float mostWeight = 2.0;

/// The point that a pixel shows, from the camera, world axes.
vec3 pointAt(vec2 pixel, float depth)
{
    return transpose(mat3(frame.cameraFromWorldOpen)) * (pixelRay(pixel) * depth);
}

float depthAt(ivec2 pixel) { return texelFetch(sceneDepth, clamp(pixel, ivec2(0), ivec2(frame.picture.xy) - 1), 0).r; }

void emit(vec3 hit, uvec4 bits, uvec4 more, float age, float depth, float weight)
{
    vec3 inCamera = mat3(frame.cameraFromWorldOpen) * hit;
    float diameter = truncatedExponential(unitFloat(bits.z), frame.splashDrop.x, frame.splashDrop.y, frame.splashDrop.z);
    Splash splash = splashOf(diameter * frame.splash.z, age, more);
    float scale = frame.lens.x / -inCamera.z;
    splash.place = vec4(frame.lens.zw + scale * vec2(inCamera.x, -inCamera.y), scale, -inCamera.z);
    splash.look.w = weight;
#ifdef FOG
    splash.light.x = exp(-textureLod(fogTable, fogTablePlace(depth), 0.0).r);
#endif
#ifdef LIGHTS
    splash.light.yzw = lampsInDrop(hit) * splash.light.x;
#endif
    uint at = atomicAdd(splashCount, 1u);
    if (at >= frame.splashKey.w) return;  // the list is full: denser than a picture can show
    atomicMax(splashGroups, at / 64u + 1u);
    splashes[at] = splash;
}

void main()
{
    ivec2 corner = ivec2(gl_GlobalInvocationID.xy) * blockSize;
    if (any(greaterThanEqual(corner, ivec2(frame.picture.xy)))) return;
    ivec2 pixel = corner + blockSize / 2;
    float depth = depthAt(pixel);
    if (!(depth < frame.splashDrop.w)) return;

    const int reach = blockSize / 2;
    float left = depthAt(pixel - ivec2(reach, 0)), right = depthAt(pixel + ivec2(reach, 0));
    float above = depthAt(pixel - ivec2(0, reach)), below = depthAt(pixel + ivec2(0, reach));
    // Planes are straight in inverse depth. Leaves, wires and edges are not, and no splash can be seen on them.
    float nearness = 1.0 / depth;
    vec2 bend = abs(vec2(1.0 / left + 1.0 / right, 1.0 / above + 1.0 / below) - 2.0 * nearness);
    if (any(greaterThan(bend, vec2(atEdge * nearness)))) return;
    vec2 centre = vec2(pixel) + 0.5;
    vec3 here = pointAt(centre, depth);
    vec3 across = pointAt(centre + vec2(reach, 0.0), right) - here;
    vec3 down = pointAt(centre + vec2(0.0, reach), below) - here;
    vec3 normal = normalize(cross(across, down));
    if (normal.y < 0.0) normal = -normal;
    if (normal.y < faceUp) return;

    // Cells as large as the footprint on the ground of a block of the full picture, so that this one touches four at
    // most, and in a proxy the cells that the full picture's blocks in its place do.
    vec2 spanX = abs(across.xz) * 2.0, spanY = abs(down.xz) * 2.0;
    float footprint = max(spanX.x + spanY.x, spanX.y + spanY.y);
    float span = max(footprint, frame.splashGrid.x);
    float fullSpan = max(footprint * frame.splashGrid.w, frame.splashGrid.x);
    float level = min(ceil(log2(fullSpan / frame.splashGrid.x)), float(frame.splashTime.y));
    float edge = frame.splashGrid.x * exp2(level);
    float events = frame.splash.x * exp2(2.0 * level);
    // Where a cell holds more impacts than can be told apart, each stands for several, but for no more than look like
    // one: far ground would glitter.
    float weight = clamp(events / float(mostPerCell), 1.0, mostWeight);
    float mean = min(events, float(mostPerCell));

    // Counted from the coarsest cell that the camera is in, so that floats stay small.
    uint subdivisions = 1u << (frame.splashTime.y - uint(level));
    uvec2 coarse = frame.splashKey.yz * subdivisions;
    vec2 ground = here.xz + frame.splashGrid.yz;
    ivec2 first = ivec2(floor((ground - 0.5 * span) / edge)), last = ivec2(floor((ground + 0.5 * span) / edge));
    last = min(last, first + int(ceil(1.0 / frame.splashGrid.w)));
    for (int j = first.y; j <= last.y; ++j)
        for (int i = first.x; i <= last.x; ++i)
            for (uint slot = 0u; slot < 2u; ++slot) {
                uvec4 cell = hash4(uvec4(uint(i) + coarse.x, uint(j) + coarse.y,
                                         frame.splashTime.x - slot, frame.splashKey.x + uint(level) * 977u));
                // A Poisson number of so small a mean, cut at the most that is drawn.
                float term = exp(-mean), sum = term, u = unitFloat(cell.x);
                uint count = 0u;
                while (u > sum && count < 3u * mostPerCell) {
                    ++count;
                    term *= mean / float(count);
                    sum += term;
                }
                for (uint event = 0u; event < count; ++event) {
                    uvec4 bits = hash4(uvec4(cell.y, cell.z, cell.w, event));
                    uvec4 more = hash4(bits);
                    // Impacts of slot s happen during it and show for a lifetime: this slot's young, the last one's old.
                    float age = frame.splash.w - unitFloat(bits.w) + float(slot);
                    if (age < 0.0 || age >= 1.0) continue;
                    vec2 at = (vec2(i, j) + vec2(unitFloat(bits.x), unitFloat(bits.y))) * edge - frame.splashGrid.yz;
                    vec3 hit = vec3(at.x, here.y - dot(normal.xz, at - here.xz) / normal.y, at.y);
                    vec3 inCamera = mat3(frame.cameraFromWorldOpen) * hit;
                    if (-inCamera.z < frame.range.x) continue;
                    vec2 onPicture = frame.lens.zw + frame.lens.x / -inCamera.z * vec2(inCamera.x, -inCamera.y);
                    vec2 inBlock = onPicture - vec2(corner);
                    if (any(lessThan(inBlock, vec2(0.0))) || any(greaterThanEqual(inBlock, vec2(blockSize)))) continue;
                    emit(hit, bits, more, age, -inCamera.z, weight);
                }
            }
}
