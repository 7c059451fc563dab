// How codes lie in a buffer of words, and what they mean. Compiled by GLSL (std430) and C++ (shared/alias.h); rows of 16
// bytes. Samples up to 8 bits are four to a word, others two, the first in the low bits. ITU-T H.273 has the equations.
struct PlanesLayout {
    uvec4 first;      // word of the first sample of each plane
    uvec4 stride;     // words from one row of each plane to the next
    uvec4 size;       // x: width; y: height [px]; z, w: -
    vec4 luma;        // x: code of 0; y: value of a step; z: largest code; w: -
    vec4 chroma;      // the same
    vec4 alpha;       // the same
    vec4 weights;     // of red, green, blue in luma; w: -
    vec4 fromChroma;  // x: red from Cr; y: blue from Cb; z, w: green from Cb, Cr
    vec4 curve;       // PowerCurve: power, offset, slope, toe
    vec4 site;        // x, y: place of a chroma sample in the pixels that share it, 0..1; z, w: -
};
