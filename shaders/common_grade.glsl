// The plate's grade: colour transfer from a still, then the rainy day's loss of colour and light (src/grade).
#ifdef COLOR_TRANSFER
layout(binding = 6) uniform sampler3D transferLut;

/// Scene-linear to the encoding of grade::ColorLut, and back.
vec3 encodeForLut(vec3 c)
{
    float delta = frame.lut.x, whole = log2(1.0 + frame.lut.y / delta);
    return mix(log2(1.0 + max(c, vec3(0.0)) / delta), c / (delta * 0.69314718056), lessThan(c, vec3(0.0))) / whole;
}
vec3 decodeFromLut(vec3 e)
{
    float delta = frame.lut.x, whole = log2(1.0 + frame.lut.y / delta);
    return mix(delta * (exp2(e * whole) - 1.0), e * whole * delta * 0.69314718056, lessThan(e, vec3(0.0)));
}

/// Trilinear by hand: many devices filter with weights of 8 bits, which is a step of the picture's code values.
vec3 lutShift(vec3 place)
{
    ivec3 node = min(ivec3(place), ivec3(int(frame.lut.z) - 2));
    vec3 t = place - vec3(node);
    vec3 shift = vec3(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        ivec3 offset = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
        vec3 weight = mix(vec3(1.0) - t, t, vec3(offset));
        shift += weight.x * weight.y * weight.z * texelFetch(transferLut, node + offset, 0).rgb;
    }
    return shift;
}

/// Pitie et al. 2005, baked: twin of grade::apply. Works on colours that are not premultiplied.
vec4 transferColor(vec4 color)
{
    float alpha = color.a > 0.0 ? color.a : 1.0;
    vec3 encoded = encodeForLut(color.rgb / alpha);
    vec3 shift = lutShift(clamp(encoded, 0.0, 1.0) * (frame.lut.z - 1.0));
    return vec4(decodeFromLut(encoded + shift) * alpha, color.a);
}
#endif

/// Starik and Werman 2003: blended with its luminance, then scaled. Twin of grade::darkened.
vec4 gradePlate(vec4 color)
{
#ifdef COLOR_TRANSFER
    color = transferColor(color);
#endif
#ifdef DARKEN
    float luminance = dot(color.rgb, vec3(0.2126, 0.7152, 0.0722));
    color.rgb = mix(color.rgb, vec3(luminance), frame.grade.y) * (1.0 - frame.grade.x);
#endif
    return color;
}
