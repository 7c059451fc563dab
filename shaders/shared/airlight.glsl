// Airlight of a point light at the fixed price of six exponentials. Compiled by GLSL and C++ (shared/alias.h); the
// exact integral and what the model leaves out are in optics/Airlight.h.
#ifndef VIRGA_FN
#define VIRGA_FN
#endif
#ifndef VIRGA_PICK
/// a where the condition holds, else b; both are computed. A function of eight numbers where C++ compiles this for lanes.
#define VIRGA_PICK
#define pick(condition, a, b) ((condition) ? (a) : (b))
#endif

/// One node of the quadrature below: the integrand times dy/dq, without constant factors.
VIRGA_FN float airlightNode(float q, float scale, float start, float across, float extinction)
{
    float k = 1.0f / (1.0f - q);
    float y = scale * q * (2.0f - q) * k * k;
    float from = start + y;
    return k * k * k * exp(-extinction * y) / (across * across + from * from);
}

/// Radiance that the medium along a view ray scatters to the camera from a light of radiant intensity 1 [1/m^2: W/(m^2
/// sr) for each W/sr]. Sun et al. 2005, "A Practical Analytic Single Scattering Model for Real Time Rendering", as an
/// integral over the way y that light goes further than straight from the lamp to the camera:
///     L = beta / (2 pi) exp(-beta l) integral_0^Y  exp(-beta y) / (h^2 + (l - s + y)^2) dy,
/// s and h the light's places along and off the ray, l = sqrt(s^2 + h^2). (Their h tan(xi) is l - s + y.) No two terms
/// cancel. The scale of y is the shorter of the fraction's, c1 = sqrt(h^2 + (l - s)^2), and of the exponential's, 1 /
/// beta; y = c / (1 - q)^2 - c then makes the integrand smooth in q, and six Gauss-Legendre nodes are left with a
/// relative error below 4.4e-4 (rms 1.1e-4) wherever lamp, camera and surface are (tests/optics/airlight_test.cpp), and
/// float's own 2e-7 l / h for lamps just off the ray. 1.35, 0.5 and 9 were chosen for the least error.
///
/// direction   from the camera through the pixel, length 1
/// distance    to the surface along the ray [m]; any size, infinity too; 0 for none
/// light       the lamp from the camera [m]
/// radius      of the lamp [m]: the ray is held off its centre by that much, where L would be infinite; at least 1e-4
/// extinction  beta [1/m]; 0 gives 0
VIRGA_FN float airlightQuadrature(vec3 direction, float distance, vec3 light, float radius, float extinction)
{
    extinction = max(extinction, 0.0f);
    float reach = min(max(distance, 0.0f), 1e15f);  // its square is a float
    float along = dot(light, direction);
    float across = max(length(light - along * direction), max(radius, 1e-4f));
    float rest = reach - along;
    float straight = sqrt(along * along + across * across);  // camera to lamp
    float atSurface = sqrt(rest * rest + across * across);   // surface to lamp
    // straight - along and atSurface + rest, each in the form that does not cancel.
    float start = pick(along > 0.0f, across * across / (straight + along), straight - along);
    float end = pick(rest > 0.0f, atSurface + rest, across * across / (atSurface - rest));
    float detour = min(reach * ((start + end) / (straight + atSurface)), 9.0f / extinction);  // Y = end - start

    float width = sqrt(across * across + start * start);
    float scale = 1.35f * width / (1.0f + 0.5f * extinction * width);
    float root = sqrt(1.0f + detour / scale);
    float last = detour / (scale * root * (root + 1.0f));  // q at Y
    float sum = 0.08566225f * (airlightNode(0.03376524f * last, scale, start, across, extinction) +
                               airlightNode(0.96623476f * last, scale, start, across, extinction)) +
                0.18038079f * (airlightNode(0.16939531f * last, scale, start, across, extinction) +
                               airlightNode(0.83060469f * last, scale, start, across, extinction)) +
                0.23395697f * (airlightNode(0.38069041f * last, scale, start, across, extinction) +
                               airlightNode(0.61930959f * last, scale, start, across, extinction));
    // beta / (2 pi) times dy = 2 scale / (1 - q)^3 dq.
    return 0.31830989f * extinction * exp(-extinction * straight) * scale * last * sum;
}

/// Nearer than this a lamp whose size is not known is no point [m].
const float pointLightRadius = 0.05f;

/// As above for a lamp of pointLightRadius.
VIRGA_FN float airlight(vec3 direction, float distance, vec3 light, float extinction)
{
    return airlightQuadrature(direction, distance, light, pointLightRadius, extinction);
}
