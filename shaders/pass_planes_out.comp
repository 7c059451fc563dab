// The beauty to codes: what io/Yuv.cpp does on the processor. Reads: the beauty. Writes: words of codes. An invocation
// has the pixels of one word of chroma, so that no two write to one word.
#include "common_planes.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(std430, binding = 2) writeonly buffer Codes { uint codes[]; };
layout(std430, binding = 7) readonly buffer Beauty { vec4 beauty[]; };

/// The nearest code, held to what a sample can hold, at its place in a word.
uint placedCode(float value, vec4 quantizer, int sampleInWord)
{
    float code = value / quantizer.y + quantizer.x + 0.5;
    return uint(clamp(code, 0.0, quantizer.z)) << (bitsOfSample * (sampleInWord % samplesPerWord));
}

void put(uint plane, int row, int word, uint value)
{
    codes[planes.first[plane] + uint(row) * planes.stride[plane] + uint(word)] = value;
}

void main()
{
    const ivec2 share = ivec2(1 << SHIFT_X, 1 << SHIFT_Y);
    ivec2 size = ivec2(planes.size.xy), block = ivec2(gl_GlobalInvocationID.xy);
    ivec2 corner = block * ivec2(samplesPerWord, 1) * share;
    if (any(greaterThanEqual(corner, size))) return;

    float first[samplesPerWord], second[samplesPerWord];
    for (int i = 0; i < samplesPerWord; ++i) first[i] = second[i] = 0.0;
    int rows = min(share.y, size.y - corner.y);
    for (int row = corner.y; row < corner.y + rows; ++row)
        for (int word = 0; word < share.x; ++word) {
            int left = corner.x + word * samplesPerWord;
            if (left >= size.x) break;
            uvec4 words = uvec4(0u);
            for (int i = 0; i < samplesPerWord && left + i < size.x; ++i) {
                vec4 light = beauty[row * size.x + left + i];
#ifdef ALPHA
                words[alphaPlane] |= placedCode(light.a, planes.alpha, i);
                light.rgb = light.a > 0.0 ? light.rgb / light.a : vec3(0.0);
#endif
                vec3 color = encodeCurve(light.rgb);
#ifdef FAMILY_RGB
                words[0] |= placedCode(color.g, planes.luma, i);
                words[1] |= placedCode(color.b, planes.luma, i);
                words[2] |= placedCode(color.r, planes.luma, i);
#else
                float luma = dot(planes.weights.rgb, color);
                int at = (word * samplesPerWord + i) >> SHIFT_X;
#ifdef YCGCO
                first[at] += 0.5 * color.g - 0.25 * (color.r + color.b);
                second[at] += 0.5 * (color.r - color.b);
#else
                first[at] += (color.b - luma) / planes.fromChroma.y;
                second[at] += (color.r - luma) / planes.fromChroma.x;
#endif
                words[0] |= placedCode(luma, planes.luma, i);
#endif
            }
            int at = left / samplesPerWord;
            put(0u, row, at, words[0]);
#ifdef FAMILY_RGB
            put(1u, row, at, words[1]);
            put(2u, row, at, words[2]);
#endif
#ifdef ALPHA
            put(alphaPlane, row, at, words[alphaPlane]);
#endif
        }
#if !defined(FAMILY_RGB) && !defined(FAMILY_GREY)
    uint firstWord = 0u, secondWord = 0u;
    for (int i = 0; i < samplesPerWord; ++i) {
        int columns = min(share.x, size.x - corner.x - i * share.x);
        if (columns <= 0) break;
        float part = 1.0 / float(columns * rows);
        firstWord |= placedCode(first[i] * part, planes.chroma, i);
        secondWord |= placedCode(second[i] * part, planes.chroma, i);
    }
    put(1u, block.y, block.x, firstWord);
    put(2u, block.y, block.x, secondWord);
#endif
}
