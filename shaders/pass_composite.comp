// The picture, from the plate and what the other passes left: grade, fog, splashes, rain, one over the other
// (docs/design.md, "Image formation"). Leaves the accumulators at zero for the next frame.
#include "common_frame.glsl"
#ifndef BLURRED
#include "common_grade.glsl"
#endif
#include "common_lights.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(binding = 0) uniform sampler2D plate;  // graded and blurred already if BLURRED
layout(std430, binding = 7) writeonly buffer Beauty { vec4 beauty[]; };
#ifdef LAYERS
layout(std430, binding = 8) writeonly buffer LayerPixels { vec4 layerPixels[]; };  // rain, splash, fog, plate: a picture each
#endif
#ifdef RAIN
layout(std430, binding = 4) buffer Accumulators { uint accumulators[]; };
#endif
#ifdef SPLASHES
layout(std430, binding = 11) buffer SplashAccumulators { uint splashAccumulators[]; };
#endif
#ifdef DEPTH
layout(binding = 1) uniform sampler2D sceneDepth;
#endif
#ifdef FOG
layout(binding = 2) uniform sampler2D fogTable;
#endif
#ifdef VEIL
layout(binding = 8) uniform sampler2D veilTable;
#endif
layout(binding = 4) uniform sampler2D lightGrid;
#if defined(BOOST) || defined(FOG)
layout(binding = 5) uniform sampler2D lowPassGrid;
#endif

/// The layer, premultiplied, that the drops over a pixel make. sums: the pixel's accumulators; lit: light that a drop
/// returns; fogLight: of the fog in front of it.
vec4 dropLayer(float sums[accumulatorsPerPixel], vec3 lit, vec3 fogLight)
{
    float alpha = 1.0 - exp(-sums[0] / opticalDepthSteps);
    vec3 light = lit;
#ifdef FOG
    light = mix(fogLight, lit, sums[1] / sums[0]);
#endif
#ifdef LIGHTS
    light += vec3(sums[lampsAccumulator], sums[lampsAccumulator + 1u], sums[lampsAccumulator + 2u]) / sums[0];
#endif
    return vec4(light * alpha, alpha);
}

vec4 over(vec4 front, vec4 back) { return front + (1.0 - front.a) * back; }

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(frame.picture.xy)))) return;
    uint index = uint(pixel.y) * frame.picture.x + uint(pixel.x);

    vec4 background = texelFetch(plate, pixel, 0);
#ifndef BLURRED
    background = gradePlate(background);
#endif
    vec4 result = background;

#if defined(RAIN) || defined(SPLASHES) || defined(FOG)
    vec2 place = ((vec2(pixel) + 0.5) / float(frame.lights.y) + 0.5) / vec2(textureSize(lightGrid, 0));
    vec3 drop = textureLod(lightGrid, place, 0.0).rgb;
#if defined(BOOST) || defined(FOG)
    vec3 behind = textureLod(lowPassGrid, place, 0.0).rgb;
#endif
#ifdef BOOST
    vec3 detail = background.rgb;
    if (frame.boost.y == 0.0) detail -= behind;
    vec3 lit = max(drop + frame.boost.x * detail, vec3(0.0));
#else
    vec3 lit = drop;
#endif
    vec3 fogLight = vec3(0.0);
#ifdef FOG
    // Of what a large drop takes out of a beam half is refracted and reflected, half is diffracted straight on
    // (Babinet): the fog returns the mean of the drop's light and of what is behind it. The paper's mode leaves its maps
    // as they ring, below 0 too.
    fogLight = mix(max(0.5 * (drop + behind), vec3(0.0)), frame.fogColor.rgb, frame.fogColor.a);
#endif
#endif

#ifdef FOG
#ifdef DEPTH
    float opticalDepth = textureLod(fogTable, fogTablePlace(texelFetch(sceneDepth, pixel, 0).r), 0.0).r;
#else
    float opticalDepth = frame.boost.z;
#endif
    float fogAlpha = 1.0 - exp(-opticalDepth);
    vec4 fog = vec4(fogLight * fogAlpha, fogAlpha);
#ifdef LIGHTS
    // Sun et al. 2005: the glow around lamps, which only adds.
    vec3 ray = pixelRay(vec2(pixel) + 0.5);
#ifdef DEPTH
    float distance = min(texelFetch(sceneDepth, pixel, 0).r, frame.range.y) * length(ray);
#else
    float distance = frame.range.y;
#endif
    vec3 direction = transpose(mat3(frame.cameraFromWorldOpen)) * normalize(ray);
    for (uint n = 0u; n < frame.lights.x; ++n)
        fog.rgb += lights[n].intensity.rgb * airlightQuadrature(direction, distance, lights[n].place.xyz, lights[n].place.w, frame.medium.x);
#endif
    result = over(fog, result);
#endif

    uint base = index * accumulatorsPerPixel;
#ifdef SPLASHES
    vec4 splash = vec4(0.0);
    if (splashAccumulators[base] != 0u) {
        float sums[accumulatorsPerPixel];
        for (uint n = 0u; n < accumulatorsPerPixel; ++n) {
            sums[n] = float(splashAccumulators[base + n]);
            splashAccumulators[base + n] = 0u;
        }
        splash = dropLayer(sums, lit, fogLight);
    }
    result = over(splash, result);
#endif

#ifdef RAIN
    vec4 rain = vec4(0.0);
    vec2 veil = vec2(0.0);
#ifdef VEIL
#ifdef DEPTH
    veil = textureLod(veilTable, fogTablePlace(texelFetch(sceneDepth, pixel, 0).r), 0.0).rg * opticalDepthSteps;
#else
    veil = frame.medium.zw * opticalDepthSteps;
#endif
#endif
    if (accumulators[base] != 0u || veil.x > 0.0) {
        float sums[accumulatorsPerPixel];
        for (uint n = 0u; n < accumulatorsPerPixel; ++n) {
            sums[n] = float(accumulators[base + n]);
            accumulators[base + n] = 0u;
        }
        sums[0] += veil.x;
#ifdef FOG
        sums[1] += veil.y;
#endif
        rain = dropLayer(sums, lit, fogLight);
    }
    result = over(rain, result);
#endif

    beauty[index] = result;
#ifdef LAYERS
    uint pixels = frame.picture.x * frame.picture.y;
#ifdef RAIN
    layerPixels[index] = rain;
#endif
#ifdef SPLASHES
    layerPixels[pixels + index] = splash;
#endif
#ifdef FOG
    layerPixels[2u * pixels + index] = fog;
#endif
    layerPixels[3u * pixels + index] = background;
#endif
}
