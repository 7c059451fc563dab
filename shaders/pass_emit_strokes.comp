// Drops of the listed cells that are seen, as strokes. One invocation a drop.
// Reads: cells, classes, waves, fog table. Writes: two lists of strokes, those that cover many pixels apart.
#include "common_frame.glsl"
#include "shared/drop_field.glsl"
#include "shared/visibility.glsl"
#include "common_lights.glsl"

#ifdef GROUPED
layout(local_size_x = 256) in;  // emitGroupSize of StrokePass.cpp
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = 1) readonly buffer Cells { Cell cells[]; };
layout(std430, binding = 14) readonly buffer Blocks { uint cellOfBlock[]; };
layout(std430, binding = 2) readonly buffer Classes
{
    TurbulenceWave waves[4];
    DropClass classes[];
};
layout(std430, binding = 3) writeonly buffer Strokes { Stroke strokes[]; };
layout(std430, binding = 6) buffer Lists
{
    uint smallGroups, smallY, smallZ, smallCount;  // the first three are the arguments of an indirect dispatch
    uint largeGroups, largeY, largeZ, largeCount;
};
#ifdef FOG
layout(binding = 2) uniform sampler2D fogTable;
#endif
uniform uint cellCount;

/// Frequency of a drop's main oscillation [Hz]. Rayleigh 1879, mode 2, water at 20 C: 344 Hz at 1 mm.
float oscillationFrequency(float diameter)
{
    return 3.8488e-3 * inversesqrt(0.125 * diameter * diameter * diameter);
}

/// Twin of matte::oscillationStrength.
float oscillationStrength(float diameter)
{
    float mm = 1e3 * diameter;
    return smoothstep(0.8, 1.4, mm) * (1.0 - 0.5 * smoothstep(1.6, 2.6, mm));
}

/// Twin of matte::strokeLayer.
uint strokeLayer(float beadCycles, float strength, float random)
{
    float groups = frame.atlas.x, variants = frame.atlas.y;
    float group = 0.0;
    if (beadCycles > 0.0)
        group = clamp(floor(frame.atlas.w * log2(beadCycles / frame.atlas.z) + 0.5), 0.0, groups - 1.0);
    float few = min(2.0, variants);
    float choices = groups == 1.0 ? variants : few + strength * (variants - few);
    float variant = clamp(floor(random * choices), 0.0, variants - 1.0);
    return uint(group * variants + variant);
}

/// What strokes are widened to [px]. Rows are integrated exactly over pixels, however narrow a stroke is; this only keeps
/// its width from vanishing.
const float narrowest = 0.05;

bool strokeOf(Drop drop, DropClass dropClass, out Stroke stroke)
{
    vec3 open = mat3(frame.cameraFromWorldOpen) * drop.open;
#ifdef CAMERA_MOTION
    vec3 close = mat3(frame.cameraFromWorldClose) * drop.close;
    float focalClose = frame.lens.y;
    float focal = sqrt((frame.lens.x * (frame.lens.x + focalClose) + focalClose * focalClose) / 3.0);
#else
    vec3 close = mat3(frame.cameraFromWorldOpen) * drop.close;
    float focalClose = frame.lens.x;
    float focal = frame.lens.x;
#endif
    float near = frame.range.x;
    float depthOpen = -open.z, depthClose = -close.z;
    // What of its way is nearer is left out, and what it covers meanwhile.
    float shown = 1.0;
    if (min(depthOpen, depthClose) < near) {
        if (max(depthOpen, depthClose) < near) return false;
        float crosses = (near - depthOpen) / (depthClose - depthOpen);
        vec3 crossing = vec3(mix(open.xy, close.xy, crosses), -near);
        if (depthOpen < near)
            open = crossing, depthOpen = near, shown = 1.0 - crosses;
        else
            close = crossing, depthClose = near, shown = crosses;
    }
    float depth = 0.5 * (depthOpen + depthClose);
    if (depth > frame.range.y) return false;
    float path = dropClass.travel.w * frame.focus.z;
    if (depth > visibleDepth(drop.diameter, path, frame.boost.w, frame.range.z)) return false;
    float drawn = drawnShare(depth, drop.diameter, path, frame.boost.w, frame.medium.y);
    if (drop.rank >= drawn * drawn) return false;

    vec2 start = frame.lens.zw + frame.lens.x / depthOpen * vec2(open.x, -open.y);
    vec2 end = frame.lens.zw + focalClose / depthClose * vec2(close.x, -close.y);
    // So that w^2 is its mean over the exposure: that of f^2 is (f0^2 + f0 f1 + f1^2) / 3, that of 1/z^2 is 1 / (z0 z1).
    float width = focal * drop.diameter * inversesqrt(depthOpen * depthClose);
    float confusion = focal * frame.focus.x * abs(1.0 / depth - frame.focus.y);
    // Variances of the drop's and the lens's profiles add.
    float full = sqrt(width * width + confusion * confusion);
    float halfWidth = 0.5 * max(full, narrowest);

    // Less than a pixel of blur along the path changes nothing that a pixel shows.
    float blur = confusion > 1.0 ? 0.25 * confusion : 0.0;
    float margin = halfWidth + blur + 1.0;
    vec2 low = min(start, end) - margin, high = max(start, end) + margin;
    if (any(lessThan(high, vec2(0.0))) || any(greaterThan(low, vec2(frame.picture.xy)))) return false;

    // pi/4 w^2: the drop's disc, wherever it is while the shutter is open.
    float covered = 0.78539816 * width * width * shown * frame.range.w / drawn;
    float random = unitFloat(drop.look);
    float beads = oscillationFrequency(drop.diameter) * frame.focus.z;
    uint layer = strokeLayer(beads, oscillationStrength(drop.diameter), random);

    stroke.path = vec4(start, end);
    stroke.body = vec4(halfWidth, covered, depthOpen, depthClose);
    float matte = float(layer + 1u);
    stroke.look = vec4((drop.look & 1u) == 0u ? matte : -matte, 1.0, width / (2.0 * halfWidth), blur);
#ifdef FOG
    stroke.look.y = exp(-textureLod(fogTable, fogTablePlace(depth), 0.0).r);
#endif
#ifdef LIGHTS
    // The veil knows nothing of lamps: strokes bring the light of those that are not drawn as well, 1 / q^2 in all.
    stroke.lamps = vec4(lampsInDrop(0.5 * (drop.open + drop.close)) * (stroke.look.y / drawn), 0.0);
#endif
    return true;
}

/// Takes the next place of a list. Hardware: one atomic a work group, because the places of a whole device queue at one
/// counter; software renderers have no queue and pay for barriers instead.
#ifdef GROUPED
shared uint wanted[2], first[2];
uint placeIn(bool large, bool visible)
{
    if (gl_LocalInvocationID.x < 2u) wanted[gl_LocalInvocationID.x] = 0u;
    barrier();
    uint mine = visible ? atomicAdd(wanted[large ? 1 : 0], 1u) : 0u;
    barrier();
    if (gl_LocalInvocationID.x == 0u && wanted[0] > 0u) {
        first[0] = atomicAdd(smallCount, wanted[0]);
        atomicMax(smallGroups, (first[0] + wanted[0] + 63u) / 64u);
    }
    if (gl_LocalInvocationID.x == 1u && wanted[1] > 0u) {
        first[1] = atomicAdd(largeCount, wanted[1]);
        atomicMax(largeGroups, first[1] + wanted[1]);
    }
    barrier();
    return first[large ? 1 : 0] + mine;
}
#else
uint placeIn(bool large, bool visible)
{
    if (!visible) return 0u;
    uint place = large ? atomicAdd(largeCount, 1u) : atomicAdd(smallCount, 1u);
    if (large)
        atomicMax(largeGroups, place + 1u);
    else if ((place & 63u) == 0u)
        atomicMax(smallGroups, place / 64u + 1u);
    return place;
}
#endif

bool dropNumber(uint number, out Stroke stroke)
{
    if (number >= frame.picture.z) return false;
    uint at = cellOfBlock[number / dropsPerBlock];
    while (at + 1u < cellCount && cells[at + 1u].key.w <= number) ++at;
    Cell cell = cells[at];
    DropClass dropClass = classes[cell.key.z];
    Drop drop = dropInCell(cell, dropClass, waves[0], waves[1], waves[2], waves[3], number - cell.key.w);
    return strokeOf(drop, dropClass, stroke);
}

void main()
{
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
    Stroke stroke;
    bool visible = dropNumber(group * gl_WorkGroupSize.x + gl_LocalInvocationID.x, stroke);
    vec2 extent = abs(stroke.path.zw - stroke.path.xy) + 2.0 * stroke.body.x;
    float footprint = max(extent.x, extent.y) * (2.0 * stroke.body.x + 1.0);
    bool large = visible && footprint > frame.atlasSize.w;
    uint place = placeIn(large, visible);
    // The two lists grow towards each other.
    if (visible) strokes[large ? frame.picture.w - 1u - place : place] = stroke;
}
