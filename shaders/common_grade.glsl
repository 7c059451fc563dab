// The plate's grade: colour transfer from a still, then the rainy day's loss of colour and light (src/grade).
#ifdef COLOR_TRANSFER
layout(binding = 6) uniform sampler3D transferLut;

/// Scene-linear to the look-up table's axes and back; twin of grade::ColorLut's shaper.
vec3 lutPlace(vec3 linear);
vec3 lutValue(vec3 place);
#endif

/// Starik and Werman 2003: averaged with its luminance, then scaled. Twin of grade::darken.
vec3 gradePlate(vec3 color)
{
#ifdef COLOR_TRANSFER
    color = transferColor(color);
#endif
#ifdef DARKEN
    float luminance = dot(color, vec3(0.2126, 0.7152, 0.0722));
    color = mix(color, vec3(luminance), frame.grade.y) * (1.0 - frame.grade.x);
#endif
    return color;
}
