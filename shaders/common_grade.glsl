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

/// Pitie et al. 2005, baked: twin of grade::apply. Works on colours that are not premultiplied.
vec4 transferColor(vec4 color)
{
    float alpha = color.a > 0.0 ? color.a : 1.0;
    vec3 encoded = encodeForLut(color.rgb / alpha);
    vec3 place = (clamp(encoded, 0.0, 1.0) * (frame.lut.z - 1.0) + 0.5) / frame.lut.z;
    return vec4(decodeFromLut(encoded + textureLod(transferLut, place, 0.0).rgb) * alpha, color.a);
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
