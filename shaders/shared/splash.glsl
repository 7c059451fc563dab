// What a drop leaves for a moment where it hits: a crown of water that rises and spreads, and droplets thrown from its
// rim. Compiled by GLSL and C++ (shared/alias.h).
#ifndef VIRGA_FN
#define VIRGA_FN
#endif

struct Splash {
    vec4 place;    // x, y: of the impact on the picture [px]; z: pixels a metre there; w: depth [m]
    vec4 crown;    // x: radius at the rim [m]; y: height [m]; z: opacity; w: radius of a droplet [m]
    vec4 look;     // x: number of droplets; y: age in lifetimes; z: hash bits as float; w: impacts that it stands for
    vec4 light;    // x: share of its light that the fog in front lets through; yzw: rgb radiance of lamps in it, fog taken off
};

/// A splash of a drop of diameter D [m] at age 0..1 of its life. After high-speed pictures of drops on a thin film of
/// water (Worthington 1908; Yarin 2006, Annu. Rev. Fluid Mech. 38): the crown's radius grows as the square root of time
/// to about 4 D, its wall rises to about 2.5 D and falls back within half the life, and droplets of D/5 fly a few
/// centimetres high.
VIRGA_FN Splash splashOf(float diameter, float age, uvec4 bits)
{
    Splash splash;
    float vigour = 0.6f + 0.8f * float(bits.x >> 8u) / 16777216.0f;
    float rise = 4.0f * age * (1.0f - age);
    splash.place = vec4(0.0f);
    splash.crown = vec4(diameter * (0.8f + 3.2f * sqrt(age)), 2.5f * vigour * diameter * rise,
                        0.8f * (1.0f - age) * (1.0f - age), 0.1f * diameter);
    splash.look = vec4(float(bits.y % 6u), age, float(bits.z >> 8u), 1.0f);
    splash.light = vec4(1.0f, 0.0f, 0.0f, 0.0f);
    return splash;
}
