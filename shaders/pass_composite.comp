// The picture, from the plate and what the other passes left: grade, fog, splashes, rain, one over the other
// (docs/design.md, "Image formation"). Leaves the accumulators at zero for the next frame.
#include "common_frame.glsl"
#ifndef BLURRED
#include "common_grade.glsl"
#endif

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
layout(binding = 4) uniform sampler2D lightGrid;
#if defined(BOOST) || defined(FOG)
layout(binding = 5) uniform sampler2D lowPassGrid;
#endif

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
    vec2 place = ((vec2(pixel) + 0.5) / float(lightGridStep) + 0.5) / vec2(textureSize(lightGrid, 0));
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
#ifdef FOG
    // Of what a large drop takes out of a beam half is refracted and reflected, half is diffracted straight on
    // (Babinet): the fog returns the mean of the drop's light and of what is behind it.
    vec3 airlight = mix(0.5 * (drop + behind), frame.fogColor.rgb, frame.fogColor.a);
#endif
#endif

#ifdef FOG
#ifdef DEPTH
    float opticalDepth = textureLod(fogTable, fogTablePlace(texelFetch(sceneDepth, pixel, 0).r), 0.0).r;
#else
    float opticalDepth = frame.boost.z;
#endif
    float fogAlpha = 1.0 - exp(-opticalDepth);
    vec4 fog = vec4(airlight * fogAlpha, fogAlpha);
    result = over(fog, result);
#endif

#ifdef SPLASHES
    uint splashSteps = splashAccumulators[2u * index], splashLight = splashAccumulators[2u * index + 1u];
    vec4 splash = vec4(0.0);
    if (splashSteps != 0u) {
        splashAccumulators[2u * index] = 0u;
        splashAccumulators[2u * index + 1u] = 0u;
        splash.a = 1.0 - exp(-float(splashSteps) / opticalDepthSteps);
        splash.rgb = splash.a * lit;
#ifdef FOG
        float clear = float(splashLight) / float(splashSteps);  // share that the fog in front lets through
        splash.rgb = splash.a * mix(airlight, lit, clear);
#endif
    }
    result = over(splash, result);
#endif

#ifdef RAIN
    vec4 rain = vec4(0.0);
#ifdef FOG
    uint rainSteps = accumulators[2u * index];
    if (rainSteps != 0u) {
        float clear = float(accumulators[2u * index + 1u]) / float(rainSteps);
        accumulators[2u * index] = 0u;
        accumulators[2u * index + 1u] = 0u;
        rain.a = 1.0 - exp(-float(rainSteps) / opticalDepthSteps);
        rain.rgb = rain.a * mix(airlight, lit, clear);
    }
#else
    uint rainSteps = accumulators[index];
    if (rainSteps != 0u) {
        accumulators[index] = 0u;
        rain.a = 1.0 - exp(-float(rainSteps) / opticalDepthSteps);
        rain.rgb = rain.a * lit;
    }
#endif
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
