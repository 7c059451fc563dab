// Draws the listed splashes: each a crown seen from the side, and droplets. One invocation a splash.
// Coverage is evaluated over a pixel's width, so small splashes fade instead of flickering.
#include "common_frame.glsl"
#include "shared/drop_field.glsl"
#include "shared/splash.glsl"

layout(local_size_x = 64) in;

layout(binding = 1) uniform sampler2D sceneDepth;
layout(std430, binding = 11) buffer SplashAccumulators { uint splashAccumulators[]; };
layout(std430, binding = 12) readonly buffer Splashes { Splash splashes[]; };
layout(std430, binding = 13) readonly buffer SplashList { uint splashGroups, splashY, splashZ, splashCount; };

void deposit(ivec2 pixel, float alpha, Splash splash)
{
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, ivec2(frame.picture.xy)))) return;
    // A splash stands before the ground that it hits; only what is clearly nearer hides it.
    if (splash.place.w > texelFetch(sceneDepth, pixel, 0).r * 1.02 + 0.05) return;
    float optical = opticalDepthOf(min(alpha, 0.9)) * opticalDepthSteps * splash.look.w;
    uint steps = uint(optical + 0.5);
    if (steps == 0u) return;
    uint base = (uint(pixel.y) * frame.picture.x + uint(pixel.x)) * accumulatorsPerPixel;
    atomicAdd(splashAccumulators[base], steps);
#ifdef FOG
    atomicAdd(splashAccumulators[base + 1u], uint(optical * splash.light.x + 0.5));
#endif
#ifdef LIGHTS
    for (uint c = 0u; c < 3u; ++c)
        atomicAdd(splashAccumulators[base + lampsAccumulator + c], uint(optical * splash.light[c + 1u] + 0.5));
#endif
}

/// A soft ball of `mass` [px^2] and radius r [px] around a place.
void droplet(vec2 at, float r, float opacity, Splash splash)
{
    float soft = max(r, 0.7);
    float peak = min(opacity * (r * r) / (soft * soft), 0.9);
    ivec2 low = ivec2(floor(at - 1.5 * soft)), high = ivec2(floor(at + 1.5 * soft));
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            vec2 d = (vec2(x, y) + 0.5 - at) / soft;
            deposit(ivec2(x, y), peak * exp(-d.x * d.x - d.y * d.y), splash);
        }
}

void crown(Splash splash)
{
    float radius = splash.crown.x * splash.place.z, height = splash.crown.y * splash.place.z;
    // Narrower than a pixel, the crown keeps what it covers.
    float softRadius = max(radius, 0.6), softHeight = max(height, 0.6);
    float opacity = splash.crown.z * min(1.0, radius / softRadius) * min(1.0, height / softHeight);
    ivec2 low = ivec2(floor(splash.place.xy - vec2(1.3 * softRadius, 1.2 * softHeight + 0.3 * softRadius)));
    ivec2 high = ivec2(floor(splash.place.xy + vec2(1.3 * softRadius, 0.4 * softRadius)));
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) {
            vec2 p = vec2(x, y) + 0.5 - splash.place.xy;
            float side = p.x / softRadius;
            // The rim is an ellipse seen at a slant; the wall leans outwards from its foot to the rim.
            float up = (-p.y + 0.25 * softRadius * (1.0 - min(side * side, 1.0))) / softHeight;
            float wall = abs(side) - (0.55 + 0.4 * clamp(up, 0.0, 1.0));
            float thickness = 0.16 + 0.5 / max(softRadius, 1.0);
            float sheet = 0.25 * smoothstep(1.05, 0.9, abs(side)) + exp(-wall * wall / (thickness * thickness));
            float inside = smoothstep(-0.25, 0.1, up) * smoothstep(1.15, 0.6, up);
            float alpha = opacity * sheet * inside;
            if (alpha > 0.002) deposit(ivec2(x, y), alpha, splash);
        }
}

void main()
{
    if (gl_GlobalInvocationID.x >= min(splashCount, frame.splashKey.w)) return;
    Splash splash = splashes[gl_GlobalInvocationID.x];
    crown(splash);

    // Droplets: ballistic, the same life as the crown's, up to a few centimetres.
    float time = splash.look.y * frame.splash.y;
    uint seed = uint(splash.look.z);
    for (uint n = 0u; n < uint(splash.look.x); ++n) {
        uvec4 bits = hash4(uvec4(seed, n, 17u, 91u));
        float out_ = (2.0 * unitFloat(bits.x) - 1.0) * 0.35, up = 0.35 + 0.55 * unitFloat(bits.y);  // [m/s]
        float height = up * time - 4.905 * time * time;
        if (height < 0.0) continue;
        vec2 at = splash.place.xy + splash.place.z * vec2(out_ * time, -height);
        float r = splash.crown.w * (0.6 + 0.8 * unitFloat(bits.z)) * splash.place.z;
        droplet(at, r, 0.8, splash);
    }
}
