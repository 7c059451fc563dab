// Equirectangular maps (docs/conventions.md: +y at the top, -z in the middle column, +x a quarter to the right), looked
// up as environment::sampleMap() does on the CPU, to single precision. Own arithmetic where devices take liberties:
// filters with weights of 8 bits, arc tangents of 16.

/// Arc tangent for |t| <= tan(pi/8), error below 1e-7. Moshier 1992, Cephes, atanf.
float arcTangent(float t)
{
    float z = t * t;
    return (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t;
}

/// Angle of (x, y) from the x axis: x eighths of a circle, a whole number, and y radians, so that what is large is exact
/// and what is rounded is small. 0 for (0, 0).
vec2 angleOf(float y, float x)
{
    float big = max(abs(x), abs(y)), small = min(abs(x), abs(y));
    if (big == 0.0) return vec2(0.0);
    vec2 angle = small > 0.41421356 * big ? vec2(1.0, arcTangent((small - big) / (small + big)))
                                          : vec2(0.0, arcTangent(small / big));
    if (abs(y) > abs(x)) angle = vec2(2.0, 0.0) - angle;
    if (x < 0.0) angle = vec2(4.0, 0.0) - angle;
    return y < 0.0 ? -angle : angle;
}

/// The map's value along `direction`, of any length but 0: bilinear, wrapped in x, held in y.
vec3 sampleEquirectangular(sampler2D map, vec3 direction)
{
    ivec2 size = textureSize(map, 0);
    vec2 azimuth = angleOf(direction.x, -direction.z);
    vec2 polar = angleOf(length(direction.xz), direction.y);
    // From the first pixel's centre: whole eighths, then what is left.
    vec2 whole = vec2(float(size.x) * (azimuth.x + 4.0) / 8.0, float(size.y) * polar.x / 4.0) - 0.5;
    vec2 rest = vec2(float(size.x) * azimuth.y * 0.15915494309, float(size.y) * polar.y * 0.31830988618);
    vec2 corner = floor(whole + rest);
    vec2 t = (whole - corner) + rest;

    int left = (int(corner.x) + size.x) % size.x, right = (left + 1) % size.x;
    int top = clamp(int(corner.y), 0, size.y - 1), bottom = clamp(int(corner.y) + 1, 0, size.y - 1);
    vec3 above = mix(texelFetch(map, ivec2(left, top), 0).rgb, texelFetch(map, ivec2(right, top), 0).rgb, t.x);
    vec3 below = mix(texelFetch(map, ivec2(left, bottom), 0).rgb, texelFetch(map, ivec2(right, bottom), 0).rgb, t.x);
    return mix(above, below, t.y);
}
