// Codes to the plate, scene-linear and premultiplied: what io/Yuv.cpp does on the processor. Reads: words of codes.
// Writes: the plate's texture. SMOOTH_X, SMOOTH_Y: chroma is interpolated along that axis, else repeated.
#include "common_planes.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std430, binding = 2) readonly buffer Codes { uint codes[]; };
layout(binding = 0, rgba32f) writeonly uniform image2D plate;

float codeAt(uint plane, ivec2 at)
{
    uint word = codes[planes.first[plane] + uint(at.y) * planes.stride[plane] + uint(at.x / samplesPerWord)];
    return float(bitfieldExtract(word, bitsOfSample * (at.x % samplesPerWord), bitsOfSample));
}

float lumaAt(uint plane, ivec2 pixel) { return (codeAt(plane, pixel) - planes.luma.x) * planes.luma.y; }

float chromaAt(uint plane, ivec2 pixel)
{
    const ivec2 share = ivec2(1 << SHIFT_X, 1 << SHIFT_Y);
    ivec2 last = (ivec2(planes.size.xy) + share - 1) / share - 1;
    vec2 place = vec2(pixel / share);
#ifdef SMOOTH_X
    place.x = (float(pixel.x) - planes.site.x * float(share.x - 1)) / float(share.x);
#endif
#ifdef SMOOTH_Y
    place.y = (float(pixel.y) - planes.site.y * float(share.y - 1)) / float(share.y);
#endif
    vec2 low = floor(place), next = place - low;
    ivec2 a = clamp(ivec2(low), ivec2(0), last), b = clamp(ivec2(low) + 1, ivec2(0), last);
    float top = codeAt(plane, a), bottom = top;
#ifdef SMOOTH_X
    top = mix(top, codeAt(plane, ivec2(b.x, a.y)), next.x);
#endif
#ifdef SMOOTH_Y
    bottom = codeAt(plane, ivec2(a.x, b.y));
#ifdef SMOOTH_X
    bottom = mix(bottom, codeAt(plane, b), next.x);
#endif
    top = mix(top, bottom, next.y);
#endif
    return (top - planes.chroma.x) * planes.chroma.y;
}

vec3 codedColor(ivec2 pixel)
{
#if defined(FAMILY_RGB)
    return vec3(lumaAt(2u, pixel), lumaAt(0u, pixel), lumaAt(1u, pixel));
#elif defined(FAMILY_GREY)
    return vec3(lumaAt(0u, pixel));
#else
    float luma = lumaAt(0u, pixel), first = chromaAt(1u, pixel), second = chromaAt(2u, pixel);
#ifdef YCGCO
    return vec3(luma - first + second, luma + first, luma - first - second);
#else
    return vec3(luma + planes.fromChroma.x * second,
                luma + planes.fromChroma.z * first + planes.fromChroma.w * second, luma + planes.fromChroma.y * first);
#endif
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(planes.size.xy)))) return;
    vec3 light = decodeCurve(codedColor(pixel));
    float alpha = 1.0;
#ifdef ALPHA
    alpha = (codeAt(alphaPlane, pixel) - planes.alpha.x) * planes.alpha.y;
#endif
    imageStore(plate, pixel, vec4(light * alpha, alpha));
}
