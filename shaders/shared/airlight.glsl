// Airlight of a point light. Compiled by GLSL and C++ (shared/alias.h).
#ifndef VIRGA_FN
#define VIRGA_FN
#endif

VIRGA_FN float airlight(vec3 direction, float distance, vec3 light, float extinction)
{
    float along = dot(light, direction);
    float off2 = max(dot(light, light) - along * along, 1e-6f);
    float off = sqrt(off2);
    float from = atan(-along / off), to = atan((distance - along) / off);
    float sum = 0.0f;
    for (int i = 0; i < 16; ++i) {
        float angle = from + (to - from) * (float(i) + 0.5f) / 16.0f;
        float s = along + off * tan(angle);
        sum += exp(-extinction * (s + off / cos(angle)));
    }
    return extinction * 0.07957747f * sum * (to - from) / (16.0f * off);
}
