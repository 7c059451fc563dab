// The blur that many raindrops in front of a thing put over it: a Gaussian whose sigma grows with depth, in two
// separable passes. A tap counts as far as its own blur reaches, and never lets a nearer, sharper thing bleed over a
// farther one or the other way round: at a depth edge each side keeps its own.
// The definition is one sum over both directions, in which a tap whose own sigma s is less than the pixel's, S, weighs
// (s/S)^2 exp(-d^2 / (2 s^2)) (reference/DepthBlur.h). Each pass has that weight: then a sharp thing leaves as much in
// its row as the sum does. What lies across a corner from a pixel, behind something sharper, is not reached:
// docs/reference.md has what that comes to.
// HORIZONTAL: grades the plate as it reads it. Else: vertical, over what the first pass wrote.
#include "common_frame.glsl"
#ifdef HORIZONTAL
#include "common_grade.glsl"
#endif

layout(local_size_x = 16, local_size_y = 16) in;

layout(binding = 0) uniform sampler2D source;
layout(binding = 0, rgba32f) writeonly uniform image2D blurred;
#ifdef DEPTH
layout(binding = 1) uniform sampler2D sceneDepth;
#endif

vec4 read(ivec2 pixel)
{
    vec4 color = texelFetch(source, pixel, 0);
#ifdef HORIZONTAL
    color = gradePlate(color);
#endif
    return color;
}

float sigmaAt(ivec2 pixel)
{
#ifdef DEPTH
    return frame.grade.z * (1.0 - exp(-texelFetch(sceneDepth, pixel, 0).r / frame.grade.w));
#else
    return frame.grade.z;
#endif
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = ivec2(frame.picture.xy);
    if (any(greaterThanEqual(pixel, size))) return;
#ifdef HORIZONTAL
    const ivec2 along = ivec2(1, 0);
#else
    const ivec2 along = ivec2(0, 1);
#endif
    float own = sigmaAt(pixel);
    vec4 centre = read(pixel);
    if (own < 0.05) {
        imageStore(blurred, pixel, centre);
        return;
    }
    int reach = int(ceil(3.0 * own));
    vec4 sum = centre;
    float weights = 1.0;
    for (int step = -reach; step <= reach; ++step) {
        ivec2 at = pixel + along * step;
        if (step == 0 || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
        float sigma = min(own, sigmaAt(at));
        float share = sigma / own;
        float weight = exp(-0.5 * float(step * step) / max(sigma * sigma, 1e-4)) * (share * share);
        sum += weight * read(at);
        weights += weight;
    }
    imageStore(blurred, pixel, sum / weights);
}
