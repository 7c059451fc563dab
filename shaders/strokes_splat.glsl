// How one stroke is added to the accumulators. A stroke is walked along its steeper axis ("rows"); in each row the
// across profile is integrated over each pixel and the matte's along profile over the row, both exactly, so that a
// stroke deposits what its drop covers whatever its width and place: strokes never alias.
//
// The across profile of a moving round drop is its chord, sqrt(1 - x^2). We take the parabola 1 - x^2 of the same
// area: its integral is a cubic instead of an arc sine, and convolved with a pixel or with defocus the two can't be
// told apart (bench, "streak shape").

layout(std430, binding = 4) buffer Accumulators { uint accumulators[]; };
#ifdef DEPTH
layout(binding = 1) uniform sampler2D sceneDepth;
#endif
#ifdef NEAREST
layout(std430, binding = 9) buffer NearestDepth { uint nearestDepth[]; };
layout(std430, binding = 10) buffer NearestMotion { uint nearestMotion[]; };
const float visibleInData = 1.0 / 1024.0;  // fainter strokes leave no depth or motion
#endif
layout(std430, binding = 5) readonly buffer AlongPrefix { float alongPrefix[]; };  // layers x (height + 1), ends at 1
layout(binding = 3) uniform sampler2DArray mattes;  // each row scaled to a mean of 1
const float resolvedTile = 8.0;  // [px]


/// Integral of the profile 3/4 (1 - x^2) from -1 to x.
float acrossIntegral(float x)
{
    x = clamp(x, -1.0, 1.0);
    return 0.5 + 0.75 * x - 0.25 * x * x * x;
}

/// Share of the stroke's mass before v in [0, 1].
float alongIntegral(uint base, float v)
{
    float height = frame.atlasSize.y;
    float at = clamp(v, 0.0, 1.0) * height;
    uint k = min(uint(at), uint(height) - 1u);
    return mix(alongPrefix[base + k], alongPrefix[base + k + 1u], at - float(k));
}

void deposit(ivec2 pixel, float alpha, float depth, Stroke stroke)
{
#ifdef DEPTH
    if (depth > texelFetch(sceneDepth, pixel, 0).r) return;
#endif
    uint index = uint(pixel.y) * frame.picture.x + uint(pixel.x);
#ifdef NEAREST_MOTION
    if (alpha < visibleInData || nearestDepth[index] != floatBitsToUint(depth)) return;
    atomicMax(nearestMotion[index], packHalf2x16(stroke.path.zw - stroke.path.xy));
#else
    float optical = opticalDepthOf(alpha) * opticalDepthSteps;
    uint steps = uint(optical + 0.5);
    if (steps == 0u) return;
    atomicAdd(accumulators[index * accumulatorsPerPixel], steps);
#ifdef FOG
    atomicAdd(accumulators[index * accumulatorsPerPixel + 1u], uint(optical * stroke.look.y + 0.5));
#endif
#ifdef LIGHTS
    uvec3 lamps = uvec3(optical * stroke.lamps.rgb + 0.5);
    for (uint c = 0u; c < 3u; ++c)
        if (lamps[c] != 0u) atomicAdd(accumulators[index * accumulatorsPerPixel + lampsAccumulator + c], lamps[c]);
#endif
#ifdef NEAREST
    if (alpha >= visibleInData) atomicMin(nearestDepth[index], floatBitsToUint(depth));
#endif
#endif
}

/// The rows that a stroke crosses, and how it lies in them.
struct Walk {
    bool steep;        // rows are picture rows (else columns)
    ivec2 rows;        // first, one past the last, inside the picture
    int columns;       // of the picture, along a row
    float middle;      // column at row coordinate 0
    float slope;       // columns a row
    float halfWidth;   // along a row [px], where the path does not move aside
    float start, stretch;  // row where the stroke's mass begins; 1 / rows to its end
    float direction;   // +1: v grows with the row
};

Walk walkOf(Stroke stroke)
{
    vec2 a = stroke.path.xy, b = stroke.path.zw;
    vec2 way = b - a;
    Walk walk;
    walk.steep = abs(way.y) >= abs(way.x);
    if (!walk.steep) {
        a = a.yx;
        b = b.yx;
        way = way.yx;
    }
    float size = length(way);
    // A drop that hardly moves is walked downwards as it is.
    float cosine = size > 1e-3 ? abs(way.y) / size : 1.0;
    walk.slope = size > 1e-3 ? way.x / way.y : 0.0;
    walk.halfWidth = stroke.body.x / cosine;
    // The mass reaches half a width beyond the path at both ends.
    float top = min(a.y, b.y) - stroke.body.x * cosine;
    float bottom = max(a.y, b.y) + stroke.body.x * cosine;
    walk.middle = 0.5 * (a.x + b.x) - walk.slope * 0.5 * (a.y + b.y);
    walk.start = top;
    walk.stretch = 1.0 / max(bottom - top, 1e-3);
    walk.direction = b.y >= a.y ? 1.0 : -1.0;
    ivec2 size2 = ivec2(frame.picture.xy);
    if (!walk.steep) size2 = size2.yx;
    // Clamped as floats: a stroke that ends far outside must not overflow the conversion.
    // Blur along the path reaches farther than the mass itself.
    vec2 ends = vec2(floor(top - stroke.look.w), floor(bottom + stroke.look.w) + 1.0);
    walk.rows = ivec2(clamp(ends, vec2(0.0), vec2(size2.y)));
    walk.columns = size2.x;
    return walk;
}

/// Share of the stroke's mass that lies before row coordinate `row`.
float massBefore(Stroke stroke, Walk walk, float row)
{
    float v = (row - walk.start) * walk.stretch;
    uint base = (uint(abs(stroke.look.x)) - 1u) * (uint(frame.atlasSize.y) + 1u);
    return walk.direction > 0.0 ? alongIntegral(base, v) : 1.0 - alongIntegral(base, 1.0 - v);
}

/// Adds one row. `share`: of the stroke's mass that falls into it.
void splatRow(Stroke stroke, Walk walk, int row, float share)
{
    float mass = stroke.body.y * share;
    if (mass * opticalDepthSteps < 0.5) return;

    // The part of the row that the stroke crosses, and how far to the side it goes in it. A parabola of half width h has
    // the variance h^2 / 5, a way of length w walked evenly w^2 / 12: variances add.
    float low = max(float(row), walk.start - stroke.look.w);
    float high = min(float(row) + 1.0, walk.start + 1.0 / walk.stretch + stroke.look.w);
    float centre = 0.5 * (low + high);
    float aside = walk.slope * max(high - low, 0.0);
    float halfWidth = sqrt(walk.halfWidth * walk.halfWidth + 0.41666667 * aside * aside);
    float v = clamp((centre - walk.start) * walk.stretch, 0.0, 1.0);
    if (walk.direction < 0.0) v = 1.0 - v;
    float depth = mix(stroke.body.z, stroke.body.w, v);
    float middle = walk.middle + walk.slope * centre;
    float inverse = 1.0 / halfWidth;
    // A drop wide and sharp enough shows its matte: the same mass a row, spread as the matte's row is.
    float tile = 2.0 * stroke.look.z * frame.atlasSize.z * walk.halfWidth;  // the tile's width in this row [px]
    bool resolved = tile > resolvedTile && stroke.look.z > 0.75;
    float reachHalf = resolved ? 0.5 * tile : halfWidth;
    vec2 reach = clamp(vec2(floor(middle - reachHalf), floor(middle + reachHalf) + 1.0), vec2(0.0), vec2(walk.columns));
    float before = acrossIntegral((reach.x - middle) * inverse);
    for (int column = int(reach.x); column < int(reach.y); ++column) {
        float after = acrossIntegral((float(column) + 1.0 - middle) * inverse);
        float across = after - before;
        before = after;
        if (resolved) {
            float u = 0.5 + sign(stroke.look.x) * (float(column) + 0.5 - middle) / tile;
            across = u < 0.0 || u > 1.0 ? 0.0 : textureLod(mattes, vec3(u, v, abs(stroke.look.x) - 1.0), 0.0).r / tile;
        }
        ivec2 pixel = walk.steep ? ivec2(column, row) : ivec2(row, column);
        deposit(pixel, min(mass * across, 0.998), depth, stroke);
    }
}

/// Share of the mass in a row that defocus smears along the path.
float blurredShare(Stroke stroke, Walk walk, int row)
{
    float reach = 0.5 + stroke.look.w;
    float centre = float(row) + 0.5;
    return (massBefore(stroke, walk, centre + reach) - massBefore(stroke, walk, centre - reach)) / (2.0 * reach);
}
