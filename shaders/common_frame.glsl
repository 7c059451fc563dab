// Bindings and small functions that every pass of a frame shares.
#define VIRGA_FN
#include "shared/frame.glsl"

layout(std430, binding = 0) readonly buffer FrameBlock { FrameConstants frame; };

/// Optical depth of the accumulators is kept in steps of 2^-18: sums up to 16384 fit, and the faintest stroke that is
/// drawn (alpha = 0.002) still has 500 steps.
const float opticalDepthSteps = 262144.0;

/// Sums kept for each pixel: optical depth; with fog, optical depth weighted with the light that the fog in front lets
/// through; with lamps, optical depth weighted with their radiance in the drop, RGB.
#ifdef FOG
const uint lampsAccumulator = 2u;
#else
const uint lampsAccumulator = 1u;
#endif
#ifdef LIGHTS
const uint accumulatorsPerPixel = lampsAccumulator + 3u;
#else
const uint accumulatorsPerPixel = lampsAccumulator;
#endif

/// -ln(1 - alpha) without cancellation for small alpha.
float opticalDepthOf(float alpha)
{
    return alpha < 0.01 ? alpha * (1.0 + alpha * (0.5 + alpha * (1.0 / 3.0))) : -log(1.0 - min(alpha, 0.998));
}

/// Where optical depth to `depth` [m] stands in the fog table: entry d / (d + scale), so that infinity has a place.
vec2 fogTablePlace(float depth)
{
    float entry = isinf(depth) ? 1.0 : depth / (depth + frame.focus.w);
    return vec2((entry * float(fogTableSize - 1) + 0.5) / float(fogTableSize), 0.5);
}

/// Direction of a pixel in camera axes, not normalised: z = -1.
vec3 pixelRay(vec2 pixel)
{
    return vec3((pixel.x - frame.lens.z) / frame.lens.x, -(pixel.y - frame.lens.w) / frame.lens.x, -1.0);
}
