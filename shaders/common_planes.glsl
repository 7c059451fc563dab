// Codes of planes in the words of a buffer. BITS: of a sample; SHIFT_X, SHIFT_Y: pixels that share a chroma sample, log2.
// FAMILY_RGB: planes G B R; FAMILY_GREY: one; else Y Cb Cr, or Y Cg Co (YCGCO). ALPHA: one plane more.
#include "shared/planes.glsl"

#ifndef BITS  // as it stands: 8 bits, 4:2:0
#define BITS 8
#define SHIFT_X 1
#define SHIFT_Y 1
#endif

layout(std430, binding = 1) readonly buffer PlanesBlock { PlanesLayout planes; };

#if BITS > 8
const int samplesPerWord = 2, bitsOfSample = 16;
#else
const int samplesPerWord = 4, bitsOfSample = 8;
#endif
#ifdef FAMILY_GREY
const uint alphaPlane = 1u;
#else
const uint alphaPlane = 3u;
#endif

/// Codes of R'G'B', 0..1 and beyond, to linear light.
vec3 decodeCurve(vec3 code)
{
    vec3 size = abs(code);
    vec3 curved = pow((size + planes.curve.y) / (1.0 + planes.curve.y), vec3(planes.curve.x));
    return mix(curved, size / planes.curve.z, lessThanEqual(size, vec3(planes.curve.w))) * sign(code);
}

vec3 encodeCurve(vec3 light)
{
    vec3 size = abs(light);
    vec3 curved = pow(size, vec3(1.0 / planes.curve.x)) * (1.0 + planes.curve.y) - planes.curve.y;
    return mix(curved, size * planes.curve.z, lessThanEqual(size, vec3(planes.curve.w / planes.curve.z))) * sign(light);
}
